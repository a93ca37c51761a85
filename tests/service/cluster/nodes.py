"""A Ray cluster of several nodes on this machine, in a process of its own that takes orders by lines.

`python -m tests.service.cluster.nodes`: head, node N THREADS [NAME=VALUE ...], remove N, stop; each is answered by a
line: the head's address, or `done`. The nodes are real raylets with stores and workers of their own.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

STORE_BYTES = 96 << 20
START_S = "30"
"""How long a raylet may take to start; where a machine is so busy that its helpers take 15 s, it dies."""

ATTEMPTS = 5


class Nodes:
    """The cluster as its tests see it.

    Attributes:
        address: of the head.
    """

    def __init__(self) -> None:
        environ = {**os.environ, "RAY_USAGE_STATS_ENABLED": "0", "RAY_raylet_start_wait_time_s": START_S}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.service.cluster.nodes"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environ,
        )  # fmt: skip
        self.address = ""

    def start_head(self) -> None:
        """A head without a worker, at the address that it had, if it had one."""
        self.address = self._order("head")

    def add(self, name: str, threads: int = 1, **environ: object) -> None:
        self._order("node", name, str(threads), *(f"{key}={value}" for key, value in environ.items()))

    def remove(self, name: str) -> None:
        """Kill a node and all of its processes."""
        self._order("remove", name)

    def stop_head(self) -> None:
        """Kill everything."""
        self._order("stop")

    def close(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()

    def _order(self, *words: str) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(" ".join(words) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline().strip()
        assert answer, f"a cluster of Ray's could not do: {' '.join(words)}"
        return answer


@contextmanager
def cluster_of(**threads: int) -> Iterator[Nodes]:
    """A head and nodes by name."""
    nodes = Nodes()
    try:
        nodes.start_head()
        for name, each in threads.items():
            nodes.add(name, each)
        yield nodes
    finally:
        nodes.close()


class _Raylets:
    """The processes of the cluster."""

    def __init__(self) -> None:
        self._port = _free_port()
        self._cluster: Any = None
        self._nodes: dict[str, Any] = {}

    def head(self) -> str:
        from ray.cluster_utils import Cluster

        for _ in range(ATTEMPTS):
            self._cluster = Cluster()
            with suppress(Exception):
                options = {"gcs_server_port": self._port, "include_dashboard": False}
                self._cluster.add_node(num_cpus=0, object_store_memory=STORE_BYTES, **options)
                return str(self._cluster.address)
            _end_children()
        return ""

    def node(self, name: str, threads: str, *variables: str) -> None:
        environ = dict(variable.split("=", 1) for variable in variables)
        self._nodes[name] = self._start(num_cpus=int(threads), env_vars=environ)

    def remove(self, name: str) -> None:
        self._cluster.remove_node(self._nodes.pop(name), allow_graceful=False)

    def stop(self) -> None:
        if self._cluster is not None:
            self._cluster.shutdown()
            self._cluster = None
            _end_children()

    def _start(self, **options: Any) -> Any:
        for _ in range(ATTEMPTS - 1):
            with suppress(Exception):
                return self._cluster.add_node(object_store_memory=STORE_BYTES, **options)
        return self._cluster.add_node(object_store_memory=STORE_BYTES, **options)


def main() -> None:
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what Ray prints is no answer
    raylets = _Raylets()
    for line in sys.stdin:
        order, *words = line.split()
        print(getattr(raylets, order)(*words) or "done", file=answers, flush=True)
    raylets.stop()


def _end_children() -> None:
    """Kill what an attempt has left, so that its port is free."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            number, _, rest = stat.read_text().partition(" ")
            if rest.rpartition(")")[2].split()[1] == str(os.getpid()):
                os.kill(int(number), signal.SIGKILL)
                os.waitpid(int(number), 0)


def _free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


if __name__ == "__main__":
    main()
