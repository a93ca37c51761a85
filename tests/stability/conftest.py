"""The renderer and the threads that all tests share."""

from __future__ import annotations

from tests.renderer.conftest import pool, renderer

__all__ = ["pool", "renderer"]
