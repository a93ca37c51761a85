"""Sixteen numbers in one: lanes, with which a kernel does the same for sixteen rays at a time.

A formula that keeps to these functions and to + - * / & | and comparisons takes lanes as well as numbers, and each
lane gets the very bits that the number alone would: nothing is contracted or reordered. In place of branches it
chooses. Rows of tables are read with `entry`, `pick` and `octet`, whose row may differ from lane to lane.

Where nothing is compiled, lanes are numpy arrays.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from renderer.kernel import COMPILED, formula

_Number = TypeVar("_Number", bool, int, float)

LANES = 16
"""Numbers side by side: float64 in one register of AVX-512, in two of AVX2, in four of NEON."""


class Lanes(types.Type):
    """LANES numbers of type `of`: float64, int64 or boolean."""

    def __init__(self, of: Any) -> None:
        self.of = of
        super().__init__(name=f"Lanes({of})")


def either(compiled: Any, plain: Any) -> Any:
    """What a function of lanes is: `compiled`, or `plain` where nothing is compiled and lanes are numpy arrays."""
    return compiled if COMPILED else plain


FLOATS, INTS = Lanes(types.float64), Lanes(types.int64)
WORDS = {types.float64: ir.DoubleType(), types.int64: ir.IntType(64), types.boolean: ir.IntType(1)}
_INDEX = ir.IntType(32)
_ADDRESS = ir.IntType(64)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    """Lanes as the compiler keeps them: a vector."""

    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, vector(lanes.of))  # type: ignore[no-untyped-call]


def vector(of: Any) -> Any:
    """The compiler's type of LANES numbers."""
    return ir.VectorType(WORDS[of], LANES)


def spread(builder: Any, number: Any) -> Any:
    """A number in every lane."""
    vector = ir.VectorType(number.type, LANES)
    undefined = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, number, _INDEX(0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES))


def as_lanes(target: Any, builder: Any, value: Any, given: Any, of: Any) -> Any:
    """Numbers or lanes of type `given` as lanes of `of`."""
    if not isinstance(given, Lanes):
        return spread(builder, target.cast(builder, value, types.unliteral(given), of))
    if given.of == of:
        return value
    if (given.of, of) == (types.int64, types.float64):
        return builder.sitofp(value, vector(of))
    raise NotImplementedError(f"{given} as lanes of {of}")


def alike(target: Any, builder: Any, values: Sequence[Any], given: Sequence[Any], of: Any, lanes: bool) -> list[Any]:
    """Arguments of types `given`, all as lanes, or else all as numbers, of `of`."""
    as_kind = as_lanes if lanes else lambda *args: target.cast(builder, *args[2:])
    return [as_kind(target, builder, value, types.unliteral(t), of) for value, t in zip(values, given, strict=True)]


@contextmanager
def each_marked(builder: Any, marks: Any) -> Iterator[Any]:
    """A loop over the lanes that are marked: the number of each, the lowest first.

    Its end depends on the marks, so that the compiler does not turn it into vectors: one lane's places in memory are
    then not gathered with the others' but read one by one, which is as fast or several times faster.
    """
    left = cgutils.alloca_once_value(builder, builder.zext(builder.bitcast(marks, ir.IntType(LANES)), _ADDRESS))
    test, body, end = (builder.append_basic_block(name) for name in ("lanes", "lane", "after"))
    builder.branch(test)
    builder.position_at_end(test)
    now = builder.load(left)
    builder.cbranch(builder.icmp_unsigned("!=", now, _ADDRESS(0)), body, end)
    builder.position_at_end(body)
    builder.store(builder.and_(now, builder.sub(now, _ADDRESS(1))), left)
    yield builder.cttz(now, ir.IntType(1)(1))
    builder.branch(test)
    builder.position_at_end(end)


def lane_of(builder: Any, room: Any, lane: Any) -> Any:
    """Address of a lane of lanes that lie in memory."""
    return builder.gep(builder.bitcast(room, room.type.pointee.element.as_pointer()), [lane])


def _common(given: Sequence[Any]) -> Any:
    """What the lanes of a result are made of, as for numbers: float64 if any is a float, else int64 or boolean."""
    kinds = [a.of if isinstance(a, Lanes) else types.unliteral(a) for a in given]
    if any(isinstance(kind, types.Float) for kind in kinds):
        return types.float64
    return types.boolean if all(kind == types.boolean for kind in kinds) else types.int64


def _operation(symbol: Any, generate: Callable[[Any, Any, Any], Any], result: Any = None) -> None:
    """Teach the compiler an operator of lanes; `generate` gets the builder, what the lanes are made of, and them."""

    class Operation(AbstractTemplate):
        def generic(self, args: Any, _kws: Any) -> Any:
            known = all(isinstance(a, Lanes | types.Number | types.Boolean) for a in args)
            if known and any(isinstance(a, Lanes) for a in args):
                return signature(Lanes(result or _common(args)), *args)
            return None

    def lower(target: Any, builder: Any, signed: Any, arguments: Any) -> Any:
        of = _common(signed.args)
        lanes = [as_lanes(target, builder, a, t, of) for a, t in zip(arguments, signed.args, strict=True)]
        return generate(builder, of, lanes)

    infer_global(symbol)(Operation)
    number = (types.Number, types.Boolean)
    for given in [(Lanes, Lanes), *((Lanes, n) for n in number), *((n, Lanes) for n in number), (Lanes,)]:
        lower_builtin(symbol, *given)(lower)


def _by_kind(floats: str, others: str) -> Callable[[Any, Any, Any], Any]:
    """The instruction `floats` for floats, `others` for the rest."""
    return lambda builder, of, lanes: getattr(builder, floats if of == types.float64 else others)(*lanes)


def _comparison(symbol: str) -> Callable[[Any, Any, Any], Any]:
    """False beside a NaN, but for !=."""

    def generate(builder: Any, of: Any, lanes: Any) -> Any:
        if of != types.float64:
            return builder.icmp_signed(symbol, *lanes)
        return (builder.fcmp_unordered if symbol == "!=" else builder.fcmp_ordered)(symbol, *lanes)

    return generate


for _symbol, _floats, _others in (
    (operator.add, "fadd", "add"),
    (operator.sub, "fsub", "sub"),
    (operator.mul, "fmul", "mul"),
    (operator.truediv, "fdiv", "fdiv"),
    (operator.neg, "fneg", "neg"),
    (operator.and_, "and_", "and_"),
    (operator.or_, "or_", "or_"),
    (operator.rshift, "ashr", "ashr"),
):
    _operation(_symbol, _by_kind(_floats, _others))
for _symbol, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _operation(_symbol, _comparison(_sign), types.boolean)


def _choose(_context: Any, mark: Any, yes: Any, no: Any) -> Any:
    lanes = any(isinstance(a, Lanes) for a in (mark, yes, no))
    of = _common((yes, no))
    result = Lanes(of) if lanes else of

    def generate(target: Any, builder: Any, signed: Any, arguments: Any) -> Any:
        marked = alike(target, builder, arguments[:1], signed.args[:1], types.boolean, lanes)
        return builder.select(*marked, *alike(target, builder, arguments[1:], signed.args[1:], of, lanes))

    return result(mark, yes, no), generate


class _Choose(Protocol):
    def __call__(self, mark: bool, yes: _Number, no: _Number, /) -> _Number: ...


choose: _Choose = either(intrinsic(_choose), lambda mark, yes, no: np.asarray(np.where(mark, yes, no))[()])
"""choose(mark, yes, no): `yes` where marked, else `no`; both are worked out."""


@formula
def least(a: _Number, b: _Number) -> _Number:
    """The smaller of two; `a` where one is not a number, as `min` has it."""
    return choose(b < a, b, a)


@formula
def most(a: _Number, b: _Number) -> _Number:
    """The larger of two; `a` where one is not a number, as `max` has it."""
    return choose(b > a, b, a)


def _instruction(name: str) -> Any:
    """A function of one float that is an instruction of its own."""

    def apply(_context: Any, number: Any) -> Any:
        result = number if isinstance(number, Lanes) else types.float64

        def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            value = arguments[0] if result is number else target.cast(builder, arguments[0], number, result)
            shape = f"v{LANES}f64" if isinstance(result, Lanes) else "f64"
            called = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(value.type, [value.type]), f"llvm.{name}.{shape}"
            )
            return builder.call(called, [value])

        return result(number), generate

    return intrinsic(apply)


root: Callable[[float], float] = either(_instruction("sqrt"), np.sqrt)
size: Callable[[float], float] = either(_instruction("fabs"), np.abs)
floor: Callable[[float], float] = either(_instruction("floor"), np.floor)


def _converted(instruction: str, source: Any, result: Any) -> Any:
    """Numbers or lanes of `source` as those of `result`, by an instruction."""

    def convert(_context: Any, number: Any) -> Any:
        lanes = isinstance(number, Lanes)

        def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            value = arguments[0] if lanes else target.cast(builder, arguments[0], number, source)
            return getattr(builder, instruction)(value, vector(result) if lanes else WORDS[result])

        return (Lanes(result) if lanes else result)(number), generate

    return intrinsic(convert)


whole: Callable[[float], int] = either(
    _converted("fptosi", types.float64, types.int64), lambda x: np.asarray(x).astype(np.int64)[()]
)
"""The integer next to a number, towards 0; it has to be within 2^63."""
bits: Callable[[float], int] = either(
    _converted("bitcast", types.float64, types.int64), lambda x: np.float64(x).view(np.int64)
)
"""The bits of a float64."""
_from_bits: Callable[[int], float] = either(
    _converted("bitcast", types.int64, types.float64), lambda n: np.int64(n).view(np.float64)
)


def _single(_context: Any, number: Any) -> Any:
    lanes = isinstance(number, Lanes)
    result = FLOATS if lanes else types.float64

    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        (wide,) = alike(target, builder, arguments, [number], types.float64, lanes)
        short = ir.VectorType(ir.FloatType(), LANES) if lanes else ir.FloatType()
        return builder.fpext(builder.fptrunc(wide, short), wide.type)

    return result(number), generate


single: Callable[[float], float] = either(
    intrinsic(_single), lambda x: np.asarray(x, np.float32).astype(np.float64)[()]
)
"""A number rounded to float32. After each + - * / or root of such numbers, these are what float32 would give (Figueroa
1995)."""


def _anywhere(_context: Any, mark: Any) -> Any:
    def generate(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        if not isinstance(mark, Lanes):
            return arguments[0]
        word = ir.IntType(LANES)
        return builder.icmp_unsigned("!=", builder.bitcast(arguments[0], word), word(0))

    return types.boolean(mark), generate


anywhere: Callable[[bool], bool] = either(intrinsic(_anywhere), lambda mark: bool(np.any(mark)))
"""Whether any lane is marked."""


def _how_many(_context: Any, mark: Any) -> Any:
    def generate(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        word = ir.IntType(LANES)
        return builder.zext(builder.ctpop(builder.bitcast(arguments[0], word)), ir.IntType(64))

    return types.int64(mark), generate


how_many: Callable[[bool], int] = either(intrinsic(_how_many), lambda mark: int(np.count_nonzero(mark)))
"""How many lanes are marked."""


def _lane_by_lane(function: Callable[..., float]) -> Any:
    """A function of floats that the processor has no instruction for, with a mark before them: 0 where unmarked."""

    def apply(context: Any, mark: Any, *numbers: Any) -> Any:
        lanes = isinstance(mark, Lanes)
        known = context.resolve_value_type(function)
        signed_function = context.resolve_function_type(known, (types.float64,) * len(numbers), {})

        def generate(target: Any, builder: Any, signed: Any, arguments: Any) -> Any:
            call = target.get_function(known, signed_function)
            (marked,) = alike(target, builder, arguments[:1], signed.args[:1], types.boolean, lanes)
            values = alike(target, builder, arguments[1:], signed.args[1:], types.float64, lanes)
            zero = [0.0] * LANES if lanes else 0.0
            found = cgutils.alloca_once_value(builder, ir.Constant(values[0].type, zero))
            if lanes:
                rooms = [cgutils.alloca_once_value(builder, value) for value in values]
                with each_marked(builder, marked) as lane:
                    alone = call(builder, [builder.load(lane_of(builder, room, lane)) for room in rooms])
                    builder.store(alone, lane_of(builder, found, lane))
            else:
                with builder.if_then(marked):
                    builder.store(call(builder, values), found)
            return builder.load(found)

        return (FLOATS if lanes else types.float64)(mark, *numbers), generate

    return apply


def _plainly(function: Callable[..., float]) -> Any:
    """`_lane_by_lane` where nothing is compiled."""

    def apply(mark: Any, *numbers: Any) -> Any:
        found = [
            function(*(float(number) for number in alone)) if marked else 0.0
            for marked, *alone in zip(*(np.ravel(a) for a in np.broadcast_arrays(mark, *numbers)), strict=True)
        ]
        return np.reshape(found, np.shape(mark))[()]

    return apply


def _of_one(function: Callable[[float], float]) -> Any:
    apply = _lane_by_lane(function)
    return either(intrinsic(lambda context, mark, a: apply(context, mark, a)), _plainly(function))


def _of_two(function: Callable[[float, float], float]) -> Any:
    apply = _lane_by_lane(function)
    return either(intrinsic(lambda context, mark, a, b: apply(context, mark, a, b)), _plainly(function))


power: Callable[[bool, float, float], float] = _of_two(operator.pow)
"""power(mark, base, exponent), where marked."""
exponential: Callable[[bool, float], float] = _of_one(math.exp)
natural_logarithm: Callable[[bool, float], float] = _of_one(math.log)
logarithm_beside_one: Callable[[bool, float], float] = _of_one(math.log1p)
arc_sine: Callable[[bool, float], float] = _of_one(math.asin)
"""The four of (mark, x), where marked."""
arc_tangent: Callable[[bool, float, float], float] = _of_two(math.atan2)
"""arc_tangent(mark, y, x): of y / x in the quadrant of (x, y), where marked."""


@formula
def binary_logarithm(x: float) -> float:
    """Logarithm to base 2 of a float64 of at least 2^-1022, to 2e-12; 1024 of infinity.

    The exponent, and of the rest, from half the root of 2 to twice that, the series of artanh (Abramowitz and Stegun
    1964, 4.1.27).
    """
    held = bits(x)
    rest = _from_bits(held & _FRACTION | _ONE)
    above = rest > math.sqrt(2.0)
    rest = choose(above, 0.5 * rest, rest)
    exponent = (held >> 52) - choose(above, 1022.0, 1023.0)
    t = (rest - 1.0) / (rest + 1.0)
    q = t * t
    series = 1.0 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * (1 / 11 + q / 13)))))
    return exponent + (2.0 / math.log(2.0)) * t * series


_FRACTION = (1 << 52) - 1
_ONE = 1023 << 52
"""Of the bits of a float64: those after the binary point, and the number 1."""
