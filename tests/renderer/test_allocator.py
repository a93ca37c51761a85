"""Memory of one frame serves the next."""

from __future__ import annotations

import json
import platform
import subprocess
import sys

import pytest

BLOCKS, BLOCK_BYTES = 6, 8 << 20

USE_BLOCKS = """
import json, resource, sys, threading
import numpy as np
from renderer.allocator import keep_freed_memory

blocks, block_bytes = int(sys.argv[1]), int(sys.argv[2])
faults = []

def use_blocks():
    for _ in range(12):
        before = resource.getrusage(resource.RUSAGE_THREAD).ru_minflt
        held = [np.zeros(block_bytes, np.uint8) for _ in range(blocks)]
        for block in held:
            block.fill(1)
        del held, block
        faults.append(resource.getrusage(resource.RUSAGE_THREAD).ru_minflt - before)

assert keep_freed_memory()
thread = threading.Thread(target=use_blocks)
thread.start()
thread.join()
print(json.dumps([faults, resource.getpagesize()]))
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")
def test_a_freed_block_costs_no_new_pages() -> None:
    """Counted by the system, on a thread of its own as frames are, in a process in which nothing else was freed."""
    words = [sys.executable, "-c", USE_BLOCKS, str(BLOCKS), str(BLOCK_BYTES)]
    faults, page = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    assert max(faults[2:]) < BLOCKS * BLOCK_BYTES // page // 100
