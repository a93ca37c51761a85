"""How the inner loops are compiled: numba, without the interpreter lock, kept on disk.

`fastmath` stays off: it would let the compiler assume that no NaN exists and contract products, which
breaks finiteness checks and edge tests. Division by zero gives infinity instead of an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

_F = TypeVar("_F", bound=Callable[..., object])


def kernel(function: _F) -> _F:
    """Compile a loop over arrays; it runs without the interpreter lock and is cached on disk."""
    return cast(_F, numba.njit(nogil=True, cache=True, error_model="numpy")(function))


formula = kernel
"""The same for a small function of numbers that kernels call."""


def _prefetch(_context: Any, rows: Any, row: Any) -> Any:
    """Ask for the two cache lines at the start of rows[row], a C-contiguous 2-D array, without waiting."""

    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = target.make_array(signature.args[0])(target, builder, arguments[0])
        index = target.cast(builder, arguments[1], signature.args[1], types.intp)
        stride = builder.extract_value(array.strides, 0)
        start = builder.ptrtoint(array.data, ir.IntType(64))
        address = builder.add(start, builder.mul(index, stride))
        byte_pointer, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        function = builder.module.declare_intrinsic(
            "llvm.prefetch", [byte_pointer], ir.FunctionType(ir.VoidType(), [byte_pointer, word, word, word])
        )
        for line in (0, 64):
            pointer = builder.inttoptr(builder.add(address, ir.Constant(ir.IntType(64), line)), byte_pointer)
            builder.call(function, [pointer, word(0), word(3), word(1)])
        return target.get_dummy_value()

    return types.void(rows, row), generate


prefetch: Any = intrinsic(_prefetch)
