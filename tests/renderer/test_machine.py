"""What a report says of the machine is what the system says."""

from __future__ import annotations

import os
from importlib import metadata
from pathlib import Path

import pytest

from renderer.accuracy.machine import METRICS, PACKAGES, processor_name, this_machine


def test_it_names_this_machine() -> None:
    machine = this_machine(3)
    assert (machine.threads, machine.cores) == (3, os.cpu_count())
    assert {name: metadata.version(name) for name in machine.packages} == machine.packages
    assert set(PACKAGES) <= set(machine.packages) <= {*PACKAGES, *METRICS}
    assert machine.processor == processor_name() != ""


@pytest.mark.skipif(not Path("/proc/meminfo").exists(), reason="needs Linux's /proc")
def test_it_has_the_memory_that_the_system_reports() -> None:
    first = Path("/proc/meminfo").read_text().splitlines()[0]
    assert this_machine(1).memory_gib == pytest.approx(int(first.split()[1]) / 2**20, abs=0.1)
