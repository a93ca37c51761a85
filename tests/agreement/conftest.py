"""One renderer for the whole folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from renderer.pipeline import Renderer


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    made = Renderer(threads=2)
    yield made
    made.close()
