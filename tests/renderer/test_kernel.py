"""How kernels are compiled: nothing may assume that there is no NaN, fuse products or raise on a division."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from numpy.typing import NDArray

import renderer
from renderer.kernel import kernel

KERNELS = {
    f"{module}.{name}": value
    for module in (info.name for info in pkgutil.iter_modules(renderer.__path__))
    for name, value in vars(importlib.import_module(f"renderer.{module}")).items()
    if isinstance(value, Dispatcher)
}


@kernel
def areas(a: NDArray[np.float64], b: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(len(out)):
        out[i] = a[i, 0] * b[i, 1] - a[i, 1] * b[i, 0]


def test_h07_no_kernel_takes_liberties_with_numbers() -> None:
    assert len(KERNELS) > 20
    for name, compiled in KERNELS.items():
        options = compiled.targetoptions
        assert not options.get("fastmath"), name
        assert options["error_model"] == "numpy", name
        assert options["nogil"], name


def test_h07_an_edge_seen_from_both_sides_is_the_same_edge() -> None:
    rng = np.random.default_rng(7)
    a, b = rng.normal(size=(2, 1_000_000, 2))
    there, back = np.zeros(len(a)), np.zeros(len(a))
    areas(a, b, there)
    areas(b, a, back)
    np.testing.assert_array_equal(there, -back)


@pytest.mark.parametrize(
    "name", ["shading.shade", "sphere.nearest_spheres", "sampling.camera_rays", "store.add_samples"]
)
def test_the_inner_loops_are_kernels(name: str) -> None:
    assert name in KERNELS
