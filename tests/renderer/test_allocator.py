"""Memory of one frame serves the next."""

from __future__ import annotations

import platform
import resource
import statistics
import threading

import numpy as np
import pytest

from renderer.allocator import keep_freed_memory

BLOCKS = 4
BLOCK_BYTES = 8 << 20


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")
def test_a_freed_block_costs_no_new_pages() -> None:
    """Counted by the system, on a thread of its own as frames are: four blocks at a time, again and again."""
    assert keep_freed_memory()
    faults: list[int] = []

    def use_blocks() -> None:
        for _ in range(12):
            before = resource.getrusage(resource.RUSAGE_THREAD).ru_minflt
            blocks = [np.zeros(BLOCK_BYTES, np.uint8) for _ in range(BLOCKS)]
            for block in blocks:
                block.fill(1)
            del blocks, block
            faults.append(resource.getrusage(resource.RUSAGE_THREAD).ru_minflt - before)

    thread = threading.Thread(target=use_blocks)
    thread.start()
    thread.join()
    # What else the process allocates may take a block's place once.
    assert statistics.median(faults) < BLOCKS * BLOCK_BYTES // resource.getpagesize() // 100
