"""How the process holds on to memory between frames."""

from __future__ import annotations

import ctypes
import functools

M_MMAP_THRESHOLD, M_TRIM_THRESHOLD = -3, -1
"""Parameters of mallopt (glibc, malloc.h)."""

LARGEST_KEPT_BYTES = 32 << 20
"""Blocks up to this size are taken from memory that the process already has: glibc's own upper bound."""

KEPT_BYTES = 256 << 20
"""Freed memory that stays with the process."""


@functools.cache
def keep_freed_memory() -> bool:
    """Have the C library keep the memory of one frame's maps and pictures for the next.

    By default glibc gives blocks of this size back to the system at once, and the next frame pays for
    getting each page anew: a quarter of the processor time of a frame after a small move of the gaze.

    Returns:
        Whether the C library took it; False where it is not glibc, and nothing has changed.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return bool(mallopt(M_MMAP_THRESHOLD, LARGEST_KEPT_BYTES)) and bool(mallopt(M_TRIM_THRESHOLD, KEPT_BYTES))
