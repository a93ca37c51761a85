"""Numbers out of arrays and into them, one by one or in lanes, each lane from a place of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from renderer.lanes import (
    FLOATS,
    INTS,
    LANES,
    WORDS,
    Lanes,
    alike,
    as_lanes,
    either,
    spread,
    vector,
)

OCTET = 8
"""Numbers of a row that are read together."""

_INDEX = ir.IntType(32)
_ADDRESS = ir.IntType(64)


def place_of(target: Any, builder: Any, given: Any, array: Any, indices: Sequence[Any]) -> Any:
    """Address of an element of an array; with indices in lanes, LANES addresses."""
    held = target.make_array(given)(target, builder, array)
    address = builder.ptrtoint(held.data, _ADDRESS)
    for dimension, index in enumerate(indices):
        stride = builder.extract_value(held.strides, dimension)
        if given.layout == "C" and dimension == given.ndim - 1:
            stride = _ADDRESS(target.get_abi_sizeof(target.get_data_type(given.dtype)))
        if isinstance(index.type, ir.VectorType):
            address, stride = spread(builder, address), spread(builder, stride)
        elif isinstance(address.type, ir.VectorType):
            index, stride = spread(builder, index), spread(builder, stride)
        address = builder.add(address, builder.mul(index, stride))
    return address


def _element(target: Any, builder: Any, kind: Any, address: Any, count: int = 0) -> Any:
    """Read the number, or `count` of them in a row, at an address; rows of a record may lie on any byte."""
    word = target.get_data_type(kind)
    shape = ir.VectorType(word, count) if count else word
    read = builder.load(builder.inttoptr(address, shape.as_pointer()))
    read.align = 1
    return read


def _gathered(target: Any, builder: Any, kind: Any, addresses: Any) -> Any:
    """Read the numbers at LANES addresses, by one instruction where the processor has it."""
    word = target.get_data_type(kind)
    numbers, marks = ir.VectorType(word, LANES), ir.VectorType(ir.IntType(1), LANES)
    pointers = builder.inttoptr(addresses, ir.VectorType(ir.IntType(8).as_pointer(), LANES))
    name = f"v{LANES}{'f' if isinstance(kind, types.Float) else 'i'}{kind.bitwidth}"
    shape = ir.FunctionType(numbers, [pointers.type, _INDEX, marks, numbers])
    gather = cgutils.get_or_insert_function(builder.module, shape, f"llvm.masked.gather.{name}.v{LANES}p0")
    everywhere, nothing = ir.Constant(marks, [1] * LANES), ir.Constant(numbers, ir.Undefined)
    return builder.call(gather, [pointers, _INDEX(1), everywhere, nothing])


def _widened(builder: Any, kind: Any, value: Any, lanes: bool) -> Any:
    """What was read of an array as float64 or int64."""
    of = _wide(kind)
    wide = vector(of) if lanes else WORDS[of]
    if value.type == wide:
        return value
    if of == types.float64:
        return builder.fpext(value, wide)
    return (builder.sext if kind.signed else builder.zext)(value, wide)


def _wide(kind: Any) -> Any:
    return types.float64 if isinstance(kind, types.Float) else types.int64


def _read(array: Any, row: Any, column: Any) -> Any:
    """Signature and code of array[row], or of array[row, column], with rows that may be lanes."""
    lanes, kind = isinstance(row, Lanes), array.dtype
    of = _wide(kind)

    def generate(target: Any, builder: Any, signed: Any, arguments: Any) -> Any:
        rows = alike(target, builder, arguments[1:2], signed.args[1:2], types.int64, lanes)
        columns = alike(target, builder, arguments[2:], signed.args[2:], types.int64, lanes=False)
        address = place_of(target, builder, array, arguments[0], [*columns, *rows][:: -1 if column else 1])
        found = (_gathered if lanes else _element)(target, builder, kind, address)
        return _widened(builder, kind, found, lanes)

    return (Lanes(of) if lanes else of)(array, row, *column), generate


def _plain_entry(array: Any, *place: Any) -> Any:
    """The same where nothing is compiled."""
    found = np.asarray(array)[place]
    return found.astype(np.float64 if found.dtype.kind == "f" else np.int64)[()]


entry: Any = either(intrinsic(lambda _context, array, row: _read(array, row, ())), _plain_entry)
"""entry(array, row): array[row] of a 1-D array, as float64 or int64."""
pick: Any = either(intrinsic(lambda _context, array, row, column: _read(array, row, (column,))), _plain_entry)
"""pick(array, row, column): array[row, column], as float64 or int64."""


def _octet(_context: Any, table: Any, row: Any, first: Any) -> Any:
    lanes = isinstance(row, Lanes)
    result = types.UniTuple(FLOATS if lanes else types.float64, OCTET)

    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        (column,) = alike(target, builder, arguments[2:], [first], types.int64, lanes=False)
        (rows,) = alike(target, builder, arguments[1:2], [row], types.int64, lanes)
        each = [builder.extract_element(rows, _INDEX(lane)) for lane in range(LANES)] if lanes else [rows]
        found = [
            _element(target, builder, types.float32, place_of(target, builder, table, arguments[0], [k, column]), OCTET)
            for k in each
        ]
        if not lanes:
            wide = builder.fpext(found[0], ir.VectorType(ir.DoubleType(), OCTET))
            return target.make_tuple(builder, result, [builder.extract_element(wide, _INDEX(k)) for k in range(OCTET)])
        parts = [_transposed(builder, found[k : k + OCTET]) for k in range(0, LANES, OCTET)]
        columns = [_joined(builder, list(column)) for column in zip(*parts, strict=True)]
        return target.make_tuple(builder, result, [builder.fpext(x, vector(types.float64)) for x in columns])

    return result(table, row, first), generate


def _joined(builder: Any, vectors: list[Any]) -> Any:
    """Vectors one after another, as one."""
    while len(vectors) > 1:
        order = ir.Constant(ir.VectorType(_INDEX, 2 * vectors[0].type.count), list(range(2 * vectors[0].type.count)))
        vectors = [builder.shuffle_vector(*pair, order) for pair in zip(vectors[::2], vectors[1::2], strict=True)]
    return vectors[0]


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Columns of OCTET rows of OCTET numbers: blocks of 1, of 2, of 4 across the diagonal change places."""
    rows = list(rows)
    for step in (1, 2, 4):
        upper = [k if k & step == 0 else OCTET + k - step for k in range(OCTET)]
        lower = [k + step if k & step == 0 else OCTET + k for k in range(OCTET)]
        for row in range(OCTET):
            if row & step == 0:
                pair = rows[row], rows[row + step]
                for place, order in ((row, upper), (row + step, lower)):
                    rows[place] = builder.shuffle_vector(*pair, ir.Constant(ir.VectorType(_INDEX, OCTET), order))
    return rows


octet: Any = either(
    intrinsic(_octet), lambda table, row, first: tuple(_plain_entry(table, row, first + k) for k in range(OCTET))
)
"""octet(table, row, first): table[row, first] to table[row, first + 7] of a C-contiguous float32 table, as float64;
faster than one `pick` after another."""


def _lane_numbers(_context: Any, first: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        start = spread(builder, target.cast(builder, arguments[0], first, types.int64))
        return builder.add(start, ir.Constant(vector(types.int64), list(range(LANES))))

    return INTS(first), generate


lane_numbers: Any = either(intrinsic(_lane_numbers), lambda first: first + np.arange(LANES))
"""lane_numbers(first): first, first + 1, ... first + LANES - 1."""


def _row_place(target: Any, builder: Any, room: Any, array: Any, row: Any, given: Any) -> Any:
    """Address of a row."""
    address = place_of(target, builder, room, array, [target.cast(builder, row, given, types.int64)])
    return builder.inttoptr(address, ir.VectorType(target.get_data_type(room.dtype), LANES).as_pointer())


def _held(_context: Any, room: Any, row: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        read = builder.load(_row_place(target, builder, room, arguments[0], arguments[1], row))
        read.align = 4
        return _widened(builder, room.dtype, read, lanes=True)

    return FLOATS(room, row), generate


held: Any = either(intrinsic(_held), lambda room, row: room[row].astype(np.float64))
"""held(room, row): a row of a (n, LANES) float64 or float32 array, as float64."""


def _keep(_context: Any, room: Any, row: Any, value: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        array, place, lanes = arguments
        if room.dtype == types.int32:
            lanes = builder.trunc(
                as_lanes(target, builder, lanes, value, types.int64), ir.VectorType(ir.IntType(32), LANES)
            )
        elif isinstance(value, Lanes) and value.of == types.boolean:
            lanes = builder.uitofp(lanes, vector(types.float64))
        else:
            lanes = as_lanes(target, builder, lanes, value, types.float64)
        if room.dtype == types.float32:
            lanes = builder.fptrunc(lanes, ir.VectorType(ir.FloatType(), LANES))
        written = builder.store(lanes, _row_place(target, builder, room, array, place, row))
        written.align = 4
        return target.get_dummy_value()

    return types.void(room, row, value), generate


def _keep_plainly(room: Any, row: int, value: Any) -> None:
    room[row] = value


keep: Any = either(intrinsic(_keep), _keep_plainly)
"""keep(room, row, value): write numbers, or marks as 0 and 1, to a row of a (n, LANES) float64 or float32 array, or
whole numbers to one of int32."""


def up_to(builder: Any, start: Any, end: Any) -> Any:
    """Which of the numbers start, start + 1, ... are no greater than `end`."""
    numbers = builder.add(spread(builder, start), ir.Constant(vector(types.int64), list(range(LANES))))
    return builder.icmp_signed("<=", numbers, spread(builder, end))


def _along(_context: Any, column: Any, first: Any, last: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        start, end = (
            target.cast(builder, value, given, types.int64)
            for value, given in zip(arguments[1:], (first, last), strict=True)
        )
        kind = column.dtype
        row = _element(target, builder, kind, place_of(target, builder, column, arguments[0], [start]), LANES)
        final = _element(target, builder, kind, place_of(target, builder, column, arguments[0], [end]))
        inside = up_to(builder, start, end)
        return _widened(builder, kind, builder.select(inside, row, spread(builder, final)), lanes=True)

    return Lanes(_wide(column.dtype))(column, first, last), generate


along: Any = either(
    intrinsic(_along), lambda column, first, last: _plain_entry(column, np.minimum(first + np.arange(LANES), last))
)
"""along(column, first, last): LANES numbers of a C-contiguous 1-D array from `first` on, beyond `last` that one again;
there has to be memory behind it, as `rays.make_columns` has it."""


def _stretch(_context: Any, column: Any, first: Any, last: Any) -> Any:
    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        start, end = (
            target.cast(builder, value, given, types.int64)
            for value, given in zip(arguments[1:], (first, last), strict=True)
        )
        kind = column.dtype
        word = target.get_data_type(kind)
        final = _element(target, builder, kind, place_of(target, builder, column, arguments[0], [end]))
        inside = up_to(builder, start, end)
        row = ir.VectorType(word, LANES)
        pointer = builder.inttoptr(place_of(target, builder, column, arguments[0], [start]), row.as_pointer())
        name = f"v{LANES}{'f' if isinstance(kind, types.Float) else 'i'}{kind.bitwidth}"
        shape = ir.FunctionType(row, [pointer.type, _INDEX, inside.type, row])
        load = cgutils.get_or_insert_function(builder.module, shape, f"llvm.masked.load.{name}.p0")
        read = builder.call(load, [pointer, _INDEX(1), inside, spread(builder, final)])
        return _widened(builder, kind, read, lanes=True)

    return Lanes(_wide(column.dtype))(column, first, last), generate


stretch: Any = either(
    intrinsic(_stretch), lambda column, first, last: _plain_entry(column, np.minimum(first + np.arange(LANES), last))
)
"""stretch(column, first, last): what `along` gives, of any C-contiguous 1-D array: nothing behind it is read."""
