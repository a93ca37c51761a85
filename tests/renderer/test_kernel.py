"""What is compiled: the inner loops, all of them."""

from __future__ import annotations

import importlib
import pkgutil

import pytest
from numba.core.dispatcher import Dispatcher

import renderer

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
