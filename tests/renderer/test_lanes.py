"""Lanes: each of them what the number alone would be, bit for bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.gather import OCTET, along, entry, held, keep, lane_numbers, octet, pick, stretch
from renderer.kernel import kernel
from renderer.lanes import (
    LANES,
    anywhere,
    arc_sine,
    arc_tangent,
    binary_logarithm,
    choose,
    exponential,
    floor,
    how_many,
    least,
    logarithm_beside_one,
    most,
    natural_logarithm,
    power,
    root,
    single,
    size,
    whole,
)
from renderer.prepared import FACET
from renderer.rays import make_columns
from renderer.scatter import add_marked, put, put_marked, put_stretch
from renderer.surface import triangle_surface, weights_at

ROWS = 32
numbers = st.lists(st.floats(-1e6, 1e6) | st.sampled_from([0.0, -0.0, math.inf, -math.inf, math.nan, 1e-300]),
                   min_size=LANES, max_size=LANES).map(np.array)  # fmt: skip


@kernel
def arithmetic_in_lanes(x: NDArray[np.float64], y: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    lane = lane_numbers(0)
    a, b = entry(x, lane), entry(y, lane)
    keep(out, 0, a + b * 2 - 1.0)
    keep(out, 1, -a / b)
    keep(out, 2, (a < b) | (a >= 2.0) & (b != 0.0))
    keep(out, 3, choose(a <= b, a, 3))
    keep(out, 4, least(a, b))
    keep(out, 5, most(a, 0.0))
    keep(out, 6, root(size(a)))
    keep(out, 7, floor(a))
    keep(out, 8, whole(choose(size(a) < 1e9, a, 0.0)))
    keep(out, 9, power(a > 0.0, a, b))
    keep(out, 10, exponential(a < 1.0, a))
    keep(out, 11, natural_logarithm(a > 0.0, a))
    keep(out, 12, logarithm_beside_one(a > 0.0, a))
    keep(out, 13, binary_logarithm(size(a) + 1.0))
    keep(out, 14, (lane * 5 >> 1) & 6)
    keep(out, 15, choose(anywhere(a > b), 1.0, 0.0))
    keep(out, 16, held(out, 4) == held(out, 5))
    keep(out, 17, single(a) * single(b))
    keep(out, 18, arc_sine(size(a) <= 1.0, a))
    keep(out, 19, arc_tangent(a > 0.0, a, b))


@kernel
def arithmetic_of_numbers(x: NDArray[np.float64], y: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    greater = False
    for lane in range(len(x)):
        greater |= x[lane] > y[lane]
    for lane in range(len(x)):
        a, b = x[lane], y[lane]
        out[0, lane] = a + b * 2 - 1.0
        out[1, lane] = -a / b
        out[2, lane] = 1.0 if a < b or (a >= 2.0 and b != 0.0) else 0.0
        out[3, lane] = a if a <= b else 3
        out[4, lane] = min(a, b)
        out[5, lane] = max(a, 0.0)
        out[6, lane] = math.sqrt(abs(a))
        out[7, lane] = np.floor(a)
        out[8, lane] = int(a) if abs(a) < 1e9 else 0
        out[9, lane] = a**b if a > 0.0 else 0.0
        out[10, lane] = math.exp(a) if a < 1.0 else 0.0
        out[11, lane] = math.log(a) if a > 0.0 else 0.0
        out[12, lane] = math.log1p(a) if a > 0.0 else 0.0
        out[13, lane] = binary_logarithm(abs(a) + 1.0)
        out[14, lane] = (lane * 5 >> 1) & 6
        out[15, lane] = 1.0 if greater else 0.0
        out[16, lane] = 1.0 if out[4, lane] == out[5, lane] else 0.0
        out[17, lane] = np.float64(np.float32(a)) * np.float64(np.float32(b))
        out[18, lane] = math.asin(a) if abs(a) <= 1.0 else 0.0
        out[19, lane] = math.atan2(a, b) if a > 0.0 else 0.0


@given(numbers, numbers)
def test_every_operation_is_that_of_numbers(x: NDArray[np.float64], y: NDArray[np.float64]) -> None:
    lanes, alone = np.zeros((ROWS, LANES)), np.zeros((ROWS, LANES))
    arithmetic_in_lanes(x, y, lanes)
    arithmetic_of_numbers(x, y, alone)
    np.testing.assert_array_equal(lanes, alone)


@given(st.floats(2.0**-1022, 1e308))
def test_the_binary_logarithm_is_that_of_the_library(x: float) -> None:
    assert binary_logarithm(x) == pytest.approx(math.log2(x), abs=2e-12 + abs(math.log2(x)) * 2.0**-52)


def test_the_binary_logarithm_of_powers_of_two_is_whole() -> None:
    assert [binary_logarithm(2.0**k) for k in range(-1022, 1024)] == list(range(-1022, 1024))
    assert binary_logarithm(math.inf) == 1024


@kernel
def gathered(table: Any, column: Any, places: Any, out: Any) -> None:
    row = entry(places, lane_numbers(0))
    keep(out, 0, entry(column, row))
    keep(out, 1, pick(table, row, 3))
    eight = octet(table, row, 2)
    for k in range(OCTET):
        keep(out, 2 + k, eight[k])


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.uint32, np.uint8, np.int64])
def test_numbers_come_from_their_places(dtype: type) -> None:
    """Of columns of records too, whose numbers lie on odd addresses."""
    draw = np.random.default_rng(5)
    table = draw.normal(size=(40, 13)).astype(np.float32)
    records = np.zeros(40, dtype=[("odd", np.uint8), ("number", dtype)])
    records["number"] = draw.integers(0, 255, 40)
    if np.issubdtype(dtype, np.signedinteger):
        records["number"] -= 128
    places = draw.integers(0, 40, LANES).astype(np.int32)
    out = np.zeros((ROWS, LANES))
    gathered(table, records["number"], places, out)
    np.testing.assert_array_equal(out[0], records["number"][places])
    np.testing.assert_array_equal(out[1], table[places, 3])
    np.testing.assert_array_equal(out[2 : 2 + OCTET], table[places, 2 : 2 + OCTET].T)


@kernel
def stretched(column: Any, whole_column: Any, first: int, last: int, floats: Any, ints: Any) -> None:
    put_stretch(floats, first, last, stretch(column, first, last))
    put_stretch(ints, first, last, stretch(whole_column, first, last))


@given(st.integers(0, 50), st.integers(0, 50), st.integers(0, 3))
def test_a_stretch_is_read_and_written_to_its_end(first: int, length: int, spare: int) -> None:
    """The last number again beyond it; what is behind it in the array is neither read nor written."""
    draw = np.random.default_rng(first)
    last = first + length
    column, numbers = draw.normal(size=last + 1 + spare).astype(np.float32), draw.integers(0, 99, last + 1 + spare)
    column[last + 1 :] = np.nan
    floats, ints = np.full(len(column), np.inf, np.float32), np.full(len(column), -1, np.int32)
    stretched(column, numbers.astype(np.int32), first, last, floats, ints)
    end = min(last + 1, first + LANES)
    np.testing.assert_array_equal(floats[first:end], column[first:end])
    np.testing.assert_array_equal(ints[first:end], numbers[first:end])
    for written in (floats, ints):
        others = np.delete(written, np.arange(first, end))
        assert (others == (np.inf if written is floats else -1)).all()
    held = np.zeros((1, LANES))
    kept_stretch(column, first, last, held)
    np.testing.assert_array_equal(held[0], column[np.minimum(first + np.arange(LANES), last)])


@kernel
def kept_stretch(column: Any, first: int, last: int, held: Any) -> None:
    keep(held, 0, stretch(column, first, last))


@kernel
def copied_in_lanes(column: Any, whole_column: Any, first: int, last: int, marks: Any, floats: Any, ints: Any) -> int:
    """Lanes from `first` on to the front of the first rows; the marked ones of them to the front of the others."""
    chosen, values = along(marks, 0, LANES - 1) != 0, along(column, first, last)
    numbers = along(whole_column, first, last)
    put(floats[0], 0, values)
    put(ints[0], 0, numbers)
    put_marked(floats[1], 0, chosen, values)
    put_marked(ints[1], 0, chosen, numbers)
    return how_many(chosen)


@given(st.integers(0, 70), st.lists(st.booleans(), min_size=LANES, max_size=LANES))
def test_columns_are_read_and_written_side_by_side(first: int, marked: list[bool]) -> None:
    """Beyond the last number that one again, whatever lies behind it; of the marked lanes no gap is left. No more than
    LANES numbers are written."""
    draw = np.random.default_rng(first)
    (column,), (numbers,), (marks,) = (make_columns(1, 71, kind) for kind in (np.float32, np.int32, np.int32))
    column[:], numbers[:], marks[:LANES] = draw.normal(size=71), draw.integers(-9, 9, 71), marked
    floats, ints = np.full((2, 2 * LANES), -7, np.float32), np.full((2, 2 * LANES), -7, np.int32)
    last = min(70, first + 20)
    assert copied_in_lanes(column, numbers, first, last, marks, floats, ints) == sum(marked)
    rows = np.minimum(first + np.arange(LANES), last)
    for found, source in ((floats, column), (ints, numbers)):
        np.testing.assert_array_equal(found[0, :LANES], source[rows])
        np.testing.assert_array_equal(found[1, : sum(marked)], source[rows][marked])
        assert (found[:, LANES:] == -7).all()


@kernel
def added_in_lanes(table: Any, marks: Any, places: Any) -> None:
    lane = lane_numbers(0)
    add_marked(table, entry(marks, lane) != 0, entry(places, lane), lane + 0.1, lane * 2, 1.0)


@given(st.lists(st.booleans(), min_size=LANES, max_size=LANES), st.lists(st.integers(0, 5), min_size=16, max_size=16))
def test_marked_lanes_are_added_one_after_another(marked: list[bool], places: list[int]) -> None:
    """To the same row, too."""
    table = np.full((6, 3), 0.3, np.float32)
    truth = table.copy()
    added_in_lanes(table, np.array(marked, np.int32), np.array(places, np.int32))
    for lane, (mark, place) in enumerate(zip(marked, places, strict=True)):
        if mark:
            truth[place] += np.array([lane + 0.1, lane * 2, 1.0]).astype(np.float32)
    np.testing.assert_array_equal(table, truth)


@kernel
def met_in_lanes(f: Any, rays: Any, out: Any) -> None:
    t = lane_numbers(0)
    ox, oy, oz, dx, dy, dz, _, _ = octet(rays, t, 0)
    b1, b2 = weights_at(f, t, ox, oy, oz, dx, dy, dz)
    s = triangle_surface(f, t, b1, b2, dx, dy, dz)
    for row, part in enumerate(
        (b1, b2, s.px, s.py, s.pz, s.gx, s.gy, s.gz, s.nx, s.ny, s.nz, s.u, s.v, s.offset, s.lift)
    ):
        keep(out, row, part)
    keep(out, 15, s.material)
    keep(out, 16, s.entering)


@kernel
def met_alone(f: Any, rays: Any, out: Any) -> None:
    for t in range(len(rays)):
        ox, oy, oz, dx, dy, dz, _, _ = octet(rays, t, 0)
        b1, b2 = weights_at(f, t, ox, oy, oz, dx, dy, dz)
        s = triangle_surface(f, t, b1, b2, dx, dy, dz)
        for row, part in enumerate(
            (b1, b2, s.px, s.py, s.pz, s.gx, s.gy, s.gz, s.nx, s.ny, s.nz, s.u, s.v, s.offset, s.lift)
        ):
            out[row, t] = part
        out[15, t] = s.material
        out[16, t] = 1.0 if s.entering else 0.0


@given(st.integers(0, 2**32 - 1))
def test_surfaces_in_lanes_are_those_alone(seed: int) -> None:
    """Smooth and flat triangles, some without area, and rays that pass beside them."""
    draw = np.random.default_rng(seed)
    facets = draw.normal(size=(LANES, FACET)).astype(np.float32)
    facets[:, 24] = draw.integers(0, 9, LANES)
    facets[:, 25] = draw.integers(0, 2, LANES)
    facets[0, 8:11] = facets[0, 0:3]
    rays = draw.normal(size=(LANES, OCTET)).astype(np.float32)
    lanes, alone = np.zeros((ROWS, LANES)), np.zeros((ROWS, LANES))
    met_in_lanes(facets, rays, lanes)
    met_alone(facets, rays, alone)
    np.testing.assert_array_equal(lanes, alone)
