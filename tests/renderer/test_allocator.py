"""Memory of one frame serves the next."""

from __future__ import annotations

import json
import platform
import subprocess
import sys

import pytest

BLOCKS, BLOCK_BYTES = 6, 8 << 20

START = """
import json, resource, sys, threading
import numpy as np
from renderer.allocator import keep_freed_memory

blocks, block_bytes = int(sys.argv[1]), int(sys.argv[2])
assert keep_freed_memory()

def use_blocks():
    before = resource.getrusage(resource.RUSAGE_THREAD).ru_minflt
    held = [np.zeros(block_bytes, np.uint8) for _ in range(blocks)]
    for block in held:
        block.fill(1)
    faults.append(resource.getrusage(resource.RUSAGE_THREAD).ru_minflt - before)

faults = []
"""

ONE_THREAD = """
thread = threading.Thread(target=lambda: [use_blocks() for _ in range(12)])
thread.start()
thread.join()
print(json.dumps([faults, resource.getpagesize()]))
"""

MANY_THREADS = """
at_once = threading.Barrier(12)  # else one thread takes over the place of another that has ended

def in_turn(turn, own, after):
    at_once.wait()
    own.wait()
    use_blocks()
    after.set()

turns = [threading.Event() for _ in range(13)]
threads = [threading.Thread(target=in_turn, args=(i, turns[i], turns[i + 1])) for i in range(12)]
for thread in threads:
    thread.start()
turns[0].set()
for thread in threads:
    thread.join()
print(json.dumps([faults, resource.getpagesize()]))
"""

pytestmark = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")


@pytest.mark.parametrize("work", [ONE_THREAD, MANY_THREADS], ids=["one thread", "many threads"])
def test_a_freed_block_costs_no_new_pages(work: str) -> None:
    """Counted by the system, on threads as frames are, in a process in which nothing else was freed."""
    words = [sys.executable, "-c", START + work, str(BLOCKS), str(BLOCK_BYTES)]
    faults, page = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    assert len(faults) == 12
    assert max(faults[2:]) < BLOCKS * BLOCK_BYTES // page // 100
