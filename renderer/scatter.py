"""Writing lanes: to columns of arrays, all of them or those that are marked, and to rows of tables."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from renderer.gather import place_of, up_to
from renderer.lanes import LANES, as_lanes, each_marked, either, lane_of

_INDEX = ir.IntType(32)
_ADDRESS = ir.IntType(64)


def _narrowed(target: Any, builder: Any, kind: Any, value: Any, given: Any) -> Any:
    """Numbers or lanes as lanes of what an array is made of, float32 or int32."""
    if isinstance(kind, types.Float):
        lanes = as_lanes(target, builder, value, given, types.float64)
        return builder.fptrunc(lanes, ir.VectorType(ir.FloatType(), LANES))
    lanes = as_lanes(target, builder, value, given, types.int64)
    return builder.trunc(lanes, ir.VectorType(ir.IntType(32), LANES))


def _put(_context: Any, column: Any, first: Any, value: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        lanes = _narrowed(target, builder, column.dtype, arguments[2], value)
        start = target.cast(builder, arguments[1], first, types.int64)
        address = place_of(target, builder, column, arguments[0], [start])
        written = builder.store(lanes, builder.inttoptr(address, lanes.type.as_pointer()))
        written.align = 4
        return target.get_dummy_value()

    return types.void(column, first, value), generate


def _put_plainly(column: Any, first: int, value: Any) -> None:
    count = min(LANES, len(column) - first)
    column[first : first + count] = np.broadcast_to(value, LANES)[:count]


put: Any = either(intrinsic(_put), _put_plainly)
"""put(column, first, value): write lanes side by side into a C-contiguous 1-D array of float32 or int32, from `first`
on; behind its end there has to be memory, as `rays.make_columns` has it."""


def _put_stretch(_context: Any, column: Any, first: Any, last: Any, value: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        lanes = _narrowed(target, builder, column.dtype, arguments[3], value)
        start, end = (
            target.cast(builder, number, given, types.int64)
            for number, given in zip(arguments[1:3], (first, last), strict=True)
        )
        inside = up_to(builder, start, end)
        pointer = builder.inttoptr(place_of(target, builder, column, arguments[0], [start]), lanes.type.as_pointer())
        shape = ir.FunctionType(ir.VoidType(), [lanes.type, pointer.type, _INDEX, inside.type])
        name = f"v{LANES}{'f' if isinstance(column.dtype, types.Float) else 'i'}32"
        store = cgutils.get_or_insert_function(builder.module, shape, f"llvm.masked.store.{name}.p0")
        builder.call(store, [lanes, pointer, _INDEX(4), inside])
        return target.get_dummy_value()

    return types.void(column, first, last, value), generate


def _put_stretch_plainly(column: Any, first: int, last: int, value: Any) -> None:
    count = min(LANES, last + 1 - first)
    column[first : first + count] = np.broadcast_to(value, LANES)[:count]


put_stretch: Any = either(intrinsic(_put_stretch), _put_stretch_plainly)
"""put_stretch(column, first, last, value): the same, but nothing behind `last` is written."""


def _put_marked(_context: Any, column: Any, first: Any, mark: Any, value: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        lanes = _narrowed(target, builder, column.dtype, arguments[3], value)
        start = target.cast(builder, arguments[1], first, types.int64)
        pointer = builder.inttoptr(place_of(target, builder, column, arguments[0], [start]), lanes.type.as_pointer())
        shape = ir.FunctionType(lanes.type, [lanes.type, arguments[2].type, lanes.type])
        name = f"v{LANES}{'f' if isinstance(column.dtype, types.Float) else 'i'}32"
        compress = cgutils.get_or_insert_function(builder.module, shape, f"llvm.experimental.vector.compress.{name}")
        packed = builder.call(compress, [lanes, arguments[2], ir.Constant(lanes.type, ir.Undefined)])
        written = builder.store(packed, pointer)
        written.align = 4
        return target.get_dummy_value()

    return types.void(column, first, mark, value), generate


def _put_marked_plainly(column: Any, first: int, mark: Any, value: Any) -> None:
    chosen = np.broadcast_to(value, LANES)[mark]
    column[first : first + len(chosen)] = chosen


put_marked: Any = either(intrinsic(_put_marked), _put_marked_plainly)
"""put_marked(column, first, mark, value): the same for the marked lanes alone, these side by side. What is in the other
rows behind is lost: to write only what is marked takes some processors 70 cycles more."""


def _add_marked(_context: Any, table: Any, mark: Any, row: Any, red: Any, green: Any, blue: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, marked, rows = arguments[:3]
        columns = [
            _narrowed(target, builder, table.dtype, value, given)
            for value, given in zip(arguments[3:], (red, green, blue), strict=True)
        ]
        kind = target.get_data_type(table.dtype).as_pointer()
        rooms = [cgutils.alloca_once_value(builder, value) for value in (rows, *columns)]
        with each_marked(builder, marked) as lane:
            to, *parts = (builder.load(lane_of(builder, room, lane)) for room in rooms)
            for part, value in enumerate(parts):
                address = place_of(target, builder, table, array, [to, _ADDRESS(part)])
                pointer = builder.inttoptr(address, kind)
                builder.store(builder.fadd(builder.load(pointer), value), pointer)
        return target.get_dummy_value()

    return types.void(table, mark, row, red, green, blue), generate


def _add_marked_plainly(table: Any, mark: Any, row: Any, *values: Any) -> None:
    for part, value in enumerate(values):
        np.add.at(table, (row[mark], part), np.broadcast_to(value, LANES)[mark].astype(table.dtype))


add_marked: Any = either(intrinsic(_add_marked), _add_marked_plainly)
"""add_marked(table, mark, row, red, green, blue): add lanes, as float32, to the first three columns of rows of a 2-D
array, where marked."""
