"""Memory of one frame serves the next; what is kept between frames lies elsewhere."""

from __future__ import annotations

import json
import mmap
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from renderer import allocator
from renderer.allocator import APART_BYTES, SPARE_BYTES, apart, keep_spare_pages, sparse

BLOCKS, BLOCK_BYTES = 6, 8 << 20

START = """
import json, resource, sys, threading
import numpy as np
from renderer import allocator
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

FRAMES, KEPT, MIB = 600, 30, 1 << 20

MAPS_OF_FRAMES = """
import ctypes, json, random, sys
from collections import deque
import numpy as np
from renderer import allocator
from renderer.allocator import apart, keep_freed_memory

class Info(ctypes.Structure):  # struct mallinfo2 of malloc.h
    _fields_ = [(name, ctypes.c_size_t) for name in "heap b c d e f g in_use h i".split()]

info = ctypes.CDLL(None).mallinfo2
info.restype = Info
assert keep_freed_memory()
frames, kept, pixels = (int(word) for word in sys.argv[1:])
lengths, maps, heap = random.Random(1), deque(maxlen=kept), []
for frame in range(frames):
    cells = lengths.randrange(150_000, 250_000)
    beside = [np.empty(lengths.randrange(50_000, 200_000), np.float32) for _ in range(3)]
    maps.append([apart(length, np.int32) for length in (cells, cells, cells, pixels)])
    del beside
    heap.append(info().heap)
print(json.dumps(heap))
"""

on_glibc = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is glibc's")


@on_glibc
@pytest.mark.parametrize("work", [ONE_THREAD, MANY_THREADS], ids=["one thread", "many threads"])
def test_a_freed_block_costs_no_new_pages(work: str) -> None:
    """Counted by the system, on threads as frames are, in a process in which nothing else was freed."""
    words = [sys.executable, "-c", START + work, str(BLOCKS), str(BLOCK_BYTES)]
    faults, page = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    assert len(faults) == 12
    assert max(faults[2:]) < BLOCKS * BLOCK_BYTES // page // 100


@on_glibc
def test_what_is_kept_does_not_spread_the_memory_of_frames() -> None:
    """Maps of 2.5 to 4 MB, 30 of them kept, come and go among arrays of 2.4 MB at most: the heap holds the latter."""
    words = [sys.executable, "-c", MAPS_OF_FRAMES, *map(str, (FRAMES, KEPT, 640 * 360))]
    heap = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    assert max(heap) < 24 * MIB
    assert heap[-1] - heap[FRAMES // 3] < MIB


@pytest.mark.parametrize("shape", [(0,), (7, 3), (APART_BYTES // 4,), (300, 200, 3)])
@pytest.mark.parametrize("dtype", [np.float32, np.int64, np.uint8])
def test_zeros_apart_are_zeros_whoever_had_their_pages(shape: tuple[int, ...], dtype: type) -> None:
    for _ in range(3):
        array = apart(shape, dtype, zeroed=True)
        assert (array.shape, array.dtype) == (shape, dtype)
        assert array.flags.c_contiguous
        assert not array.any()
        array.fill(1)
        del array


@pytest.mark.skipif(sys.platform == "win32", reason="arrays have no pages of their own there")
def test_pages_go_to_the_next_array_once_nobody_sees_them() -> None:
    first = apart((40_000, 3), np.float32)
    place, view = first.ctypes.data, first[1:, 0]
    del first
    assert apart((40_000, 3), np.float32).ctypes.data != place
    del view
    others = [apart((40_000, 3), np.float32).ctypes.data for _ in range(3)]
    assert place in others


@pytest.mark.skipif(sys.platform == "win32", reason="arrays have no pages of their own there")
@pytest.mark.parametrize(("length", "taken"), [(1.0, True), (0.85, True), (0.7, False), (1.05, False)])
def test_pages_go_to_arrays_that_are_a_little_smaller_at_most(length: float, taken: bool) -> None:
    allocator._spare.clear()
    bytes_before = 3 * MIB + 12_345
    first = apart(bytes_before, np.uint8)
    place = first.ctypes.data
    del first
    second = apart(int(length * bytes_before), np.uint8)
    assert (second.ctypes.data == place) is taken


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs /proc")
@pytest.mark.parametrize("most_bytes", [SPARE_BYTES, SPARE_BYTES // 4])
def test_few_pages_wait_for_a_next_array(most_bytes: int) -> None:
    def resident_bytes() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE

    keep_spare_pages(0)
    before = resident_bytes()
    keep_spare_pages(most_bytes)
    arrays = [apart(length, np.uint8) for length in range(MIB, 5 * MIB, MIB // 16)]
    for array in arrays:
        array.fill(1)
    assert resident_bytes() - before > 4 * SPARE_BYTES
    del array
    arrays.clear()
    assert most_bytes - 5 * MIB < resident_bytes() - before < most_bytes + 8 * MIB
    keep_spare_pages(SPARE_BYTES)


def test_sparse_zeros_take_memory_only_where_they_are_written() -> None:
    """A page or two of a gibibyte; the process itself reads how many of its pages are in memory."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        pytest.skip("needs /proc, as Linux has it")

    def resident() -> int:
        return int(statm.read_text().split()[1]) * mmap.PAGESIZE

    before = resident()
    zeros = sparse(2**27, np.float64)
    zeros[[0, 2**26, -1]] = 1.0
    assert zeros[1] == zeros[2**26 + 1] == 0.0
    assert resident() - before < 2**24
    assert sparse(0, np.int64).shape == (0,)
