"""One renderer for the whole run: its threads and kernels are made once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings

from renderer.pipeline import Renderer
from renderer.workers import WorkerPool

settings.register_profile("kernels", deadline=None)  # the first example of a test may compile kernels
settings.load_profile("kernels")


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    made = Renderer(threads=2)
    yield made
    made.close()


@pytest.fixture(scope="session")
def pool() -> Iterator[WorkerPool]:
    """Threads for tests that need no renderer."""
    made = WorkerPool(2)
    yield made
    made.close()
