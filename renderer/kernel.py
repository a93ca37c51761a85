"""How the inner loops are compiled: numba, without the interpreter lock, kept on disk.

`fastmath` stays off: it would let the compiler assume that no NaN exists and contract products, which
breaks finiteness checks and edge tests. Division by zero gives infinity instead of an exception.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, register_jitable

from renderer.version import PACKAGE, source_hash

_F = TypeVar("_F", bound=Callable[..., object])

KEPT_VERSIONS = 3
"""Compiled versions of the renderer that stay on disk."""


def _cache_folder() -> Path:
    """Where this version's compiled kernels are kept: the first of the usual places that can be written.

    numba notices a change of the file a kernel is in, but not of the files whose functions it calls, so
    every version of the source has a folder of its own.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    places = [Path(given)] if given else [PACKAGE / "__pycache__", home / "gazetrace", Path(tempfile.gettempdir())]
    for place in places:
        folder = place / f"gazetrace-kernels-{source_hash()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            _forget_old_versions(place)
            return folder
    return places[0]


def _forget_old_versions(place: Path) -> None:
    """Leave the newest versions; a process that still runs an old one has its kernels in memory."""
    versions = sorted(place.glob("gazetrace-kernels-*"), key=lambda folder: folder.stat().st_mtime, reverse=True)
    for folder in versions[KEPT_VERSIONS:]:
        shutil.rmtree(folder, ignore_errors=True)


numba.config.CACHE_DIR = str(_cache_folder())  # type: ignore[attr-defined]


COMPILED: bool = not numba.config.DISABLE_JIT  # type: ignore[attr-defined]
"""False with NUMBA_DISABLE_JIT=1: kernels are then plain Python, which checks every index, and takes its time."""

_OPTIONS: dict[str, Any] = {"nogil": True, "cache": True, "error_model": "numpy"}
_MAKES_NO_ARRAYS: dict[str, Any] = {"_nrt": False}


def kernel(function: _F) -> _F:
    """Compile a loop over arrays it is given; it runs without the interpreter lock and is cached on disk.

    It can make no arrays of its own (numba's run-time for them stays out). In return an array can be taken out
    of a record anywhere, even for each ray: otherwise that counts references, which made shading twice as slow.
    """
    return cast(_F, numba.njit(**_OPTIONS, **_MAKES_NO_ARRAYS)(function))


def formula(function: _F) -> _F:
    """The same for a small function of numbers, written out wherever a kernel calls it.

    Left to itself the compiler calls the larger ones, and handing over a surface and a few arrays for each ray
    took as long as the arithmetic.
    """
    return cast(_F, numba.njit(**_OPTIONS, **_MAKES_NO_ARRAYS, forceinline=True)(function))


def roomy_kernel(function: _F) -> _F:
    """A kernel that makes arrays of its own; it should take others out of their records before its loops."""
    return cast(_F, numba.njit(**_OPTIONS)(function))


def shared(function: _F) -> _F:
    """A function that stays plain Python where Python calls it, and is compiled into kernels that call it."""
    return register_jitable(function)


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


prefetch: Any = intrinsic(_prefetch) if COMPILED else lambda _rows, _row: None


def _call(_context: Any, _function: Any, _a: Any, _b: Any, _c: Any, _d: Any) -> Any:
    """Call the C function `void f(void*, void*, void*, void*)` at an address, with four addresses."""

    def generate(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        pointer = ir.FunctionType(ir.VoidType(), [word] * 4).as_pointer()
        builder.call(builder.inttoptr(arguments[0], pointer), arguments[1:])
        return target.get_dummy_value()

    return types.void(*[types.int64] * 5), generate


call: Any = intrinsic(_call)


class Entry(NamedTuple):
    """Where a kernel is compiled.

    Attributes:
        address: of its code.
        kinds: stands for the types of its arguments.
    """

    address: int
    kinds: int


def entry_of(function: Any, *arguments: Any) -> Entry:
    """Where `function`, a kernel that returns nothing, is compiled for arguments of these types; it takes a while."""
    kinds = tuple(numba.typeof(argument) for argument in arguments)
    function.compile(kinds)
    compiled = function.overloads[kinds]
    address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return Entry(address, zlib.crc32(repr(kinds).encode()))


def _through(_context: Any, entry: Any, arguments: Any) -> Any:
    """Call the kernel at an entry with a tuple of arguments.

    A kernel that another calls by its name is compiled once more within that one; through its entry it is not.
    """
    kinds = tuple(arguments)

    def generate(target: Any, builder: Any, _signature: Any, values: Any) -> Any:
        address, found = cgutils.unpack_tuple(builder, values[0], 2)
        convention = target.call_conv
        expected = found.type(zlib.crc32(repr(kinds).encode()))
        with cgutils.if_unlikely(builder, builder.icmp_unsigned("!=", found, expected)):
            convention.return_user_exc(builder, TypeError, ("a kernel was compiled for other types of arguments",))
        kind = convention.get_function_type(types.none, kinds)
        callee = builder.inttoptr(address, kind.as_pointer())
        unpacked = cgutils.unpack_tuple(builder, values[1], len(kinds))
        status, _ = convention.call_function(builder, callee, types.none, kinds, unpacked)
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return target.get_dummy_value()

    return types.void(entry, arguments), generate


through: Any = intrinsic(_through)


def _at(_context: Any, _address: Any, sample: Any) -> Any:
    """The numbers of the type of `sample` at an address, to be read and written by index."""

    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], target.get_data_type(signature.args[1]).as_pointer())

    return types.CPointer(sample)(types.int64, sample), generate


at: Any = intrinsic(_at)


def c_function(function: Callable[[Any], None]) -> Any:
    """Compile `function`, of one pointer to 64-bit words, for C to call; its `address` is what C wants."""
    signature = types.void(types.CPointer(types.int64))
    return numba.cfunc(signature, cache=True, error_model="numpy")(function)
