"""Memory of one frame serves the next."""

from __future__ import annotations

import platform
import resource
import threading

import numpy as np
import pytest

from renderer.allocator import keep_freed_memory

BLOCK_BYTES = 8 << 20


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")
def test_a_freed_block_costs_no_new_pages() -> None:
    """Counted by the system, on a thread of its own as frames are: ten blocks in turn take the pages of one."""
    assert keep_freed_memory()
    faults: list[int] = []

    def use_blocks() -> None:
        for _ in range(12):
            before = resource.getrusage(resource.RUSAGE_THREAD).ru_minflt
            np.zeros(BLOCK_BYTES, np.uint8).fill(1)
            faults.append(resource.getrusage(resource.RUSAGE_THREAD).ru_minflt - before)

    thread = threading.Thread(target=use_blocks)
    thread.start()
    thread.join()
    assert sum(faults[2:]) < BLOCK_BYTES // resource.getpagesize() // 4
