"""The machine that times are measured on."""

from __future__ import annotations

import contextlib
import os
import platform
import re
from importlib import metadata
from pathlib import Path
from typing import Final

from renderer.accuracy.record import Machine

PACKAGES: Final = ("numpy", "numba", "llvmlite", "embreex", "pillow")
"""Packages whose versions decide speed or pictures."""

METRICS: Final = ("flip-evaluator", "pyfvvdp")
"""Packages that judge pictures; any may be missing."""

CPU_INFO: Final = Path("/proc/cpuinfo")
"""Where Linux names the processor."""


def this_machine(threads: int) -> Machine:
    """What this process runs on.

    Args:
        threads: that frames are rendered on.
    """
    memory_bytes = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return Machine(
        processor=processor_name(),
        cores=os.cpu_count() or 1,
        threads=threads,
        memory_gib=round(memory_bytes / 2**30, 1),
        platform=platform.platform(),
        python=platform.python_version(),
        packages={name: metadata.version(name) for name in PACKAGES} | _versions(METRICS),
    )


def processor_name() -> str:
    """The processor's model, or its architecture where the system does not name it."""
    if CPU_INFO.exists():
        found = re.search(r"^model name\s*:\s*(.+)$", CPU_INFO.read_text(), re.MULTILINE)
        if found is not None:
            return found[1].strip()
    return platform.processor() or platform.machine()


def _versions(names: tuple[str, ...]) -> dict[str, str]:
    """Those that are installed."""
    installed = {}
    for name in names:
        with contextlib.suppress(metadata.PackageNotFoundError):
            installed[name] = metadata.version(name)
    return installed
