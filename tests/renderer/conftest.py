"""One renderer for the whole run: its threads and kernels are made once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from renderer.pipeline import Renderer
from renderer.workers import WorkerPool


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
