"""Samples to be traced elsewhere, and what they come to: compact, and with every bit that the sample store needs.

Cells go out as runs of equal squares in a row, two bytes a number, compressed: for aligned cells some hundredths of a
byte each. Back come either the samples themselves, 12 bytes each, or the sums of the cells, 20 bytes each (32 with
adaptive antialiasing), which continue the sums that a cell has already; whichever is less.
"""

from __future__ import annotations

import time
import zlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import Squares
from renderer.frame import RayCounts
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.store import SampleStore, add_samples
from renderer.tracing import Lack, ThreadTracing, Traced, block_starts, total_rays
from renderer.whitted import Cells, View, block_rays, trace_cells
from renderer.workers import Workers

SAMPLE_BYTES = 12
"""Of a sample: its radiance in three float32."""

NUMBER_BYTES = 4
COLUMNS = 6
"""Of a run: left and top pixel, side, first sample, end of the samples, squares."""

FASTEST = 1
"""Level of the compression: more take longer than they save on a wire of 1 Gbit/s."""


class Piece(NamedTuple):
    """Cells and samples to be traced.

    Attributes:
        view, quality: as `Lack` has them.
        white, adaptive: of the sample store.
        sums: True where sums come back, False where samples do.
        cells: runs of squares, see `pack_cells`.
        known: float32 sums of the cells that have samples already, those of a kind after one another; empty where
            samples come back.
    """

    view: View
    quality: Quality
    white: float
    adaptive: bool
    sums: bool
    cells: bytes
    known: bytes


class Colours(NamedTuple):
    """A piece that was traced.

    Attributes:
        numbers: float32 radiance of each sample, or sums of each cell, those of a kind after one another.
        rays: by kind.
        rejected: samples that were no light, by kind; zeros where samples come back, as they are judged there.
        trace_ns: what it took [ns].
    """

    numbers: bytes
    rays: RayCounts
    rejected: tuple[int, ...]
    trace_ns: int


def piece_of(lack: Lack, store: SampleStore, part: slice, *, sums: bool) -> Piece:
    """A part of what is lacking.

    Args:
        lack, store: as a frame hands them over.
        part: of the chosen squares.
        sums: whether sums are to come back; see `cheaper_as_sums`.
    """
    squares, chosen = lack.squares, lack.chosen[part]
    first, until = lack.first[part], lack.until[part]
    cells = pack_cells(squares.x[chosen], squares.y[chosen], squares.side[chosen], first, until)
    known = _sums(store, squares.slots[chosen[first > 0]]) if sums else b""
    return Piece(lack.view, lack.quality, float(store.white), _is_adaptive(store), sums, cells, known)


def cheaper_as_sums(lack: Lack, store: SampleStore) -> bool:
    """Whether it takes fewer bytes, both ways together, to have sums sent back than samples."""
    samples = int((lack.until - lack.first).sum())
    cells = len(lack.chosen) + int(np.count_nonzero(lack.first))
    return SAMPLE_BYTES * samples > NUMBER_BYTES * _numbers_a_cell(_is_adaptive(store)) * cells


def trace_piece(prepared: PreparedScene, piece: Piece, pool: Workers) -> Colours:
    """Trace a piece on this machine.

    Args:
        prepared: the scene, with the effects of the piece's quality.
        piece: cells and samples.
        pool: threads.
    """
    began_ns = time.monotonic_ns()
    x, y, side, first, until = unpack_cells(piece.cells)
    everyone = np.arange(len(x), dtype=np.int32)
    if not piece.sums:
        cells = Cells(x, y, side, everyone, first, until)
        radiance, rays = _radiance(prepared, piece, cells, pool)
        return Colours(radiance.tobytes(), rays, (0, 0, 0), time.monotonic_ns() - began_ns)
    store = SampleStore(len(x), piece.adaptive, piece.white)
    begun = np.flatnonzero(first)
    _set_sums(store, begun, piece.known)
    store.samples.number[:] = first
    squares = Squares(x, y, side, everyone.astype(np.int64))
    lack = Lack(prepared, piece.view, piece.quality, squares, everyone, first, until)
    found = ThreadTracing().trace(lack, store, pool)
    rejected = tuple(found.rejected.tolist())
    return Colours(_sums(store, everyone), found.rays, rejected, time.monotonic_ns() - began_ns)


def take_in(lack: Lack, store: SampleStore, part: slice, piece_sums: bool, colours: Colours) -> Traced:
    """Put what came back for a part into the store."""
    chosen, until = lack.chosen[part], lack.until[part]
    if piece_sums:
        slots = lack.squares.slots[chosen]
        _set_sums(store, slots, colours.numbers)
        store.samples.number[slots] = until
        return Traced(colours.rays, np.array(colours.rejected, dtype=np.int64))
    radiance = np.frombuffer(colours.numbers, dtype=np.float32).reshape(-1, 3).copy()
    rejected = add_samples(store.samples, store.spread, store.white, lack.squares.slots, chosen, until, radiance)
    return Traced(colours.rays, np.array(rejected, dtype=np.int64))


def pack_cells(
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    first: NDArray[np.int32],
    until: NDArray[np.int32],
) -> bytes:
    """Squares and samples as runs: neighbours in a row, of the same side and with the same samples.

    Args:
        x, y, side, first, until: (n,) int32, 0 to 65535.
    """
    same = np.zeros(len(x), dtype=np.bool_)
    same[1:] = x[1:] - x[:-1] == side[:-1]
    for column in (y, side, first, until):
        same[1:] &= column[1:] == column[:-1]
    starts = np.flatnonzero(~same)
    lengths = np.diff(starts, append=len(x))
    table = np.stack([*(column[starts] for column in (x, y, side, first, until)), lengths]).astype(np.uint16)
    table[:, 1:] -= table[:, :-1].copy()  # modulo 2^16: neighbours differ little
    planes = table.astype("<u2").view(np.uint8).reshape(COLUMNS, -1, 2).transpose(0, 2, 1)
    return zlib.compress(planes.tobytes(), FASTEST)


def unpack_cells(packed: bytes) -> tuple[NDArray[np.int32], ...]:
    """x, y, side, first and until of `pack_cells`, each (n,) int32."""
    planes = np.frombuffer(zlib.decompress(packed), dtype=np.uint8).reshape(COLUMNS, 2, -1)
    table = np.cumsum(np.ascontiguousarray(planes.transpose(0, 2, 1)).view("<u2")[:, :, 0], axis=1, dtype=np.uint16)
    *columns, lengths = table.astype(np.int32)
    x, y, side, first, until = (np.repeat(column, lengths) for column in columns)
    within = np.arange(len(x), dtype=np.int32) - np.repeat(np.cumsum(lengths) - lengths, lengths).astype(np.int32)
    return x + within * side, y, side, first, until


def _radiance(
    prepared: PreparedScene, piece: Piece, cells: Cells, pool: Workers
) -> tuple[NDArray[np.float32], RayCounts]:
    """(samples, 3) float32 radiance of all samples of some cells."""
    samples = cells.until - cells.first
    radiance = np.zeros((int(samples.sum()), 3), dtype=np.float32)
    rows = np.concatenate(([0], np.cumsum(samples)))
    starts = block_starts(cells.first, cells.until, block_rays(prepared, piece.quality))
    counts = [RayCounts()] * (len(starts) - 1)

    def trace_block(block: int) -> None:
        part = slice(starts[block], starts[block + 1])
        some = cells._replace(chosen=cells.chosen[part], first=cells.first[part], until=cells.until[part])
        found, counts[block] = trace_cells(prepared, piece.view, some, piece.quality)
        radiance[rows[part.start] : rows[part.stop]] = found

    pool.run(trace_block, len(counts))
    return radiance, total_rays(counts)


def _is_adaptive(store: SampleStore) -> bool:
    return len(store.spread.low) > 0


def _numbers_a_cell(adaptive: bool) -> int:
    return 8 if adaptive else 5


def _columns(store: SampleStore) -> list[NDArray[np.float32]]:
    """The sums of a store, each (slots,)."""
    samples, spread = store.samples, store.spread
    decided = [spread.low, spread.high, spread.square] if _is_adaptive(store) else []
    return [*samples.total.T, samples.shown, samples.square, *decided]


def _sums(store: SampleStore, slots: NDArray[np.integer]) -> bytes:
    return b"".join(column[slots].tobytes() for column in _columns(store))


def _set_sums(store: SampleStore, slots: NDArray[np.integer], numbers: bytes) -> None:
    columns = _columns(store)
    values = np.frombuffer(numbers, dtype=np.float32).reshape(len(columns), -1)
    for column, value in zip(columns, values, strict=True):
        column[slots] = value
    store.samples.colour[slots] = 0
