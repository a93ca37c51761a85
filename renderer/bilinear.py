"""The weighted mean of four texels, for each of LANES places.

A texel is four codes, three of which stand for numbers in a table: twelve numbers a place, each from an address of its
own. They are read one by one. The instruction that reads from many addresses at once saves nothing by that, and on some
processors takes 17 cycles for eight numbers: shading took a quarter longer with it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from renderer.lanes import FLOATS, LANES, alike, each_marked, either, lane_of, vector

SHIFTS = (0, 8, 16)
"""Where red, green and blue begin in a texel [bits]."""

CODE = 255
"""The bits of one code."""

_WORD = ir.IntType(64)


def _four_texels(
    _context: Any, mark: Any, texels: Any, decoded: Any,
    a: Any, b: Any, c: Any, d: Any, wa: Any, wb: Any, wc: Any, wd: Any,
) -> Any:  # fmt: skip
    result = types.UniTuple(FLOATS, len(SHIFTS))

    def generate(target: Any, builder: Any, signed: Any, arguments: Any) -> Any:
        (marked,) = alike(target, builder, arguments[:1], signed.args[:1], types.boolean, lanes=True)
        places = alike(target, builder, arguments[3:7], signed.args[3:7], types.int64, lanes=True)
        weights = alike(target, builder, arguments[7:], signed.args[7:], types.float64, lanes=True)
        codes, table = (
            target.make_array(kind)(target, builder, array).data
            for kind, array in zip((texels, decoded), arguments[1:3], strict=True)
        )
        rooms = [cgutils.alloca_once_value(builder, value) for value in (*places, *weights)]
        nothing = ir.Constant(vector(types.float64), [0.0] * LANES)
        means = [cgutils.alloca_once_value(builder, nothing) for _ in SHIFTS]
        with each_marked(builder, marked) as lane:
            numbers = [builder.load(lane_of(builder, room, lane)) for room in rooms]
            four = [builder.zext(builder.load(builder.gep(codes, [place])), _WORD) for place in numbers[:4]]
            for shift, room in zip(SHIFTS, means, strict=True):
                mean = _mean(builder, four, numbers[4:], shift, table)
                builder.store(mean, lane_of(builder, room, lane))
        return target.make_tuple(builder, result, [builder.load(room) for room in means])

    return result(mark, texels, decoded, a, b, c, d, wa, wb, wc, wd), generate


def _mean(builder: Any, texels: list[Any], weights: list[Any], shift: int, table: Any) -> Any:
    """Of one channel, summed in the order of the texels."""
    parts = []
    for texel, weight in zip(texels, weights, strict=True):
        code = builder.and_(builder.lshr(texel, _WORD(shift)), _WORD(CODE))
        parts.append(builder.fmul(weight, builder.load(builder.gep(table, [code]))))
    total, *others = parts
    for part in others:
        total = builder.fadd(total, part)
    return total


def _plain_four_texels(mark: Any, texels: Any, decoded: Any, *numbers: Any) -> tuple[Any, ...]:
    texel = [np.where(mark, texels[np.where(mark, place, 0)], 0) for place in numbers[:4]]
    means = []
    for shift in SHIFTS:
        a, b, c, d = (weight * decoded[t >> shift & CODE] for t, weight in zip(texel, numbers[4:], strict=True))
        means.append(np.where(mark, a + b + c + d, 0.0))
    return tuple(means)


four_texels: Any = either(intrinsic(_four_texels), _plain_four_texels)
"""four_texels(mark, texels, decoded, a, b, c, d, wa, wb, wc, wd): red, green and blue, in lanes, of texels a, b, c, d
of a C-contiguous array of uint32, summed by their weights, each code as what it stands for in `decoded`, (256,)
float64; 0 where unmarked."""
