"""What is compiled: the inner loops, all of them."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import renderer
from renderer.kernel import COMPILED, Entry, entry_of, kernel, through

KERNELS = {
    f"{module}.{name}": value
    for module in (info.name for info in pkgutil.iter_modules(renderer.__path__))
    for name, value in vars(importlib.import_module(f"renderer.{module}")).items()
    if isinstance(value, Dispatcher)
}


@pytest.mark.parametrize(
    "name", ["shading.shade", "sphere.nearest_spheres", "sampling.camera_rays", "store.add_samples"]
)
def test_the_inner_loops_are_kernels(name: str) -> None:
    assert name in KERNELS


@kernel
def write(numbers: Any, value: Any) -> None:
    numbers[0] = value


@kernel
def write_through(entry: Entry, numbers: Any, value: Any) -> None:
    through(entry, (numbers, value))


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled, so there is nothing to call by address")
def test_a_kernel_is_called_at_its_entry_and_for_no_other_types() -> None:
    numbers = np.zeros(1)
    write_through(entry_of(write, numbers, 2.5), numbers, 2.5)
    assert numbers.tolist() == [2.5]
    for others, value in ((numbers.astype(np.float32), 2.5), (numbers, 2)):
        with pytest.raises(TypeError, match="compiled for other types"):
            write_through(entry_of(write, numbers, 2.5), others, value)
        write_through(entry_of(write, others, value), others, value)
        assert others.tolist() == [value]
