"""How the process holds on to memory between frames."""

from __future__ import annotations

import ctypes
import functools

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
