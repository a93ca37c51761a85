"""`--cluster` of the commands that render many frames."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from clients.command_line.errors import UsageError
from clients.command_line.progress import working
from renderer.errors import SettingsError

if TYPE_CHECKING:
    from service.cluster.cluster import Cluster

PATIENCE_S: Final = 300.0
"""How long the first worker may take to be ready [s]: it may have to compile the kernels."""


def add_cluster(parser: argparse.ArgumentParser) -> None:
    """Add `--cluster`."""
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="have the workers of a Ray cluster do it: HOST:PORT, `auto` for the one that this machine is part of, "
        "`local` to start one here",
    )


def check_cluster(address: str | None) -> None:
    """Return if this may be the address of a cluster, or none.

    Raises:
        UsageError: if it is not, or Ray is not installed.
    """
    if address is None:
        return
    from service.settings import require_cluster, require_ray

    try:
        require_cluster("--cluster", address)
        require_ray("--cluster")
    except SettingsError as error:
        raise UsageError(f"{error.field}: expected {error.expected}, found {error.found!r}") from error


@contextmanager
def joined(address: str, threads: int | None) -> Iterator[Cluster]:
    """A cluster that has a worker, until the block ends.

    Args:
        address: as `check_cluster` lets it pass.
        threads: of one that is started here.

    Raises:
        ClusterLost: if it has none for a long time.
    """
    from service.cluster.cluster import Cluster

    cluster = Cluster(address, threads, lambda line: print(f"gazetrace: {line}", file=sys.stderr))
    try:
        with working(f"joining the cluster {address}; where kernels are compiled, that takes a minute or two"):
            cluster.wait_ready(PATIENCE_S)
        yield cluster
    finally:
        cluster.close()
