"""In the process of a service: writes down, again and again, how much memory is in use in it once garbage is gone."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
from pathlib import Path

LOOK_S = 0.25


class _Counts(ctypes.Structure):
    """`struct mallinfo2` (glibc, malloc.h)."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost",
        )
    ]  # fmt: skip


def _tell(file: Path) -> None:
    mallinfo2 = ctypes.CDLL(None).mallinfo2
    mallinfo2.restype = _Counts
    spare = file.with_suffix(".new")
    over = threading.Event()
    while not over.wait(LOOK_S):
        if gc.get_freeze_count():  # ready: before, a look at all objects takes too long
            gc.collect()
            counts = mallinfo2()
            spare.write_text(str(counts.uordblks + counts.hblkhd))
            spare.replace(file)


if "IN_USE_FILE" in os.environ and "service" in sys.orig_argv:
    threading.Thread(target=_tell, args=(Path(os.environ["IN_USE_FILE"]),), daemon=True).start()
