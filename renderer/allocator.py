"""How the process holds on to memory between frames, and where what it keeps lies."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import math
import mmap
import weakref
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Parameters of mallopt (glibc, malloc.h)."""

LARGEST_KEPT_BYTES = 32 << 20
"""Blocks up to this size are taken from memory that the process already has: glibc's own upper bound."""

KEPT_BYTES = 256 << 20
"""Freed memory that stays with the process."""

ARENAS = 1
"""Places that blocks are taken from. By default threads have their own, in pieces of 64 MiB, and what was freed in one
is of no use to another: over 1,000 frames of two streams at 480x270 memory grew by 6.3 KB a frame; with one place by
0.3, at the same processor time (20.5 ms a frame) and to 86 MiB less."""

APART_BYTES = 64 << 10
"""Arrays from this size on have pages of their own when they are kept: smaller ones would waste much of the last."""

HUGE_BYTES = 4 << 20
"""Arrays from this size on ask for huge pages, as NumPy has its own do."""

SPARE_BYTES = 32 << 20
SPARES = 64
"""Pages that were given back stay for the next array of their size: so much of them until told more, and so many."""

WASTE = 4
"""One part in so many of an array's pages may be left over: maps of one screen differ in size by less."""


@functools.cache
def keep_freed_memory() -> bool:
    """Have the C library keep the memory of one frame's maps and pictures for the next, whichever thread renders it.

    By default glibc gives blocks of this size back to the system at once, and the next frame pays for
    getting each page anew: a quarter of the processor time of a frame after a small move of the gaze.

    Call it before there are threads: those that have a place of their own already keep it.

    Returns:
        Whether the C library took it; False where it is not glibc, and nothing has changed.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    wanted = ((M_MMAP_THRESHOLD, LARGEST_KEPT_BYTES), (M_TRIM_THRESHOLD, KEPT_BYTES), (M_ARENA_MAX, ARENAS))
    taken = [mallopt(parameter, value) for parameter, value in wanted]
    return all(taken)


def keep_spare_pages(most_bytes: int) -> None:
    """Have so many bytes of pages that were given back wait for the next array of `apart`.

    New pages must be cleared first: for the samples of a whole frame of 1920x1080 that took 4 % of its time.
    """
    global _most_spare_bytes
    _most_spare_bytes = most_bytes
    _drop_spare_pages()


def apart(shape: int | tuple[int, ...], dtype: DTypeLike, zeroed: bool = False) -> NDArray[Any]:
    """An array for what is kept between frames, in pages of its own.

    What is kept is freed in another order than it came in. Among the memory of frames it would leave holes that fit
    nothing: with a gaze that moves over 640x360, whose maps take each other's places in a full cache, the process
    grew by 8 KB a frame over 1,000 frames while what was in use did not grow.

    Args:
        shape, dtype: as of numpy.empty.
        zeroed: False if anything may be in it; zeros that are new take memory only where they are written.

    Raises:
        MemoryError: if there are no pages.
    """
    lengths = (shape,) if isinstance(shape, int) else shape
    size = math.prod(lengths) * np.dtype(dtype).itemsize
    if size < APART_BYTES or not hasattr(mmap, "MAP_ANONYMOUS"):
        return np.zeros(lengths, dtype) if zeroed else np.empty(lengths, dtype)
    used = _spare_pages(size)
    pages = used or _new_pages(size)
    owner = np.frombuffer(pages, np.uint8)
    weakref.finalize(owner, _give_back, pages).atexit = False
    array = owner[:size].view(dtype).reshape(lengths)
    if zeroed and used:
        array.fill(0)
    return array


def sparse(length: int, dtype: DTypeLike) -> NDArray[Any]:
    """(length,) zeros that take memory only where they are written, page by page.

    Raises:
        MemoryError: if there are no pages.
    """
    size = max(1, length * np.dtype(dtype).itemsize)
    if not hasattr(mmap, "MAP_ANONYMOUS"):
        return np.zeros(length, dtype)
    return np.frombuffer(_map(size), dtype, length)


_spare: deque[mmap.mmap] = deque(maxlen=SPARES)
_most_spare_bytes = SPARE_BYTES


def _spare_pages(size: int) -> mmap.mmap | None:
    """The fewest spare pages of at least this size that are no waste, if there are any.

    Without a lock: other arrays may end at any moment in here.
    """
    fitting = [pages for pages in list(_spare) if size <= len(pages) <= size + size // WASTE]
    for pages in sorted(fitting, key=len):
        with contextlib.suppress(ValueError):  # another thread was faster
            _spare.remove(pages)
            return pages
    return None


def _give_back(pages: mmap.mmap) -> None:
    _spare.append(pages)
    _drop_spare_pages()


def _drop_spare_pages() -> None:
    with contextlib.suppress(IndexError):
        while sum(map(len, list(_spare))) > _most_spare_bytes:
            _spare.popleft()


def _map(size: int) -> mmap.mmap:
    try:
        return mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError as error:
        raise MemoryError(f"no {size:,} bytes of memory") from error


def _new_pages(size: int) -> mmap.mmap:
    pages = _map(size)
    if size >= HUGE_BYTES and hasattr(mmap, "MADV_HUGEPAGE"):
        with contextlib.suppress(OSError):  # a kernel without them
            pages.madvise(mmap.MADV_HUGEPAGE)
    return pages
