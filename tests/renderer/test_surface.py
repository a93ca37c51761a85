"""Where on its triangle a ray met it."""

from __future__ import annotations

import numpy as np
import pytest

from renderer.prepared import FACET
from renderer.surface import weights_at


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_weights_are_those_of_the_point_the_ray_goes_to(size: float) -> None:
    """And stay inside the triangle for a ray that passes it by; a triangle without area has its first corner."""
    rng = np.random.default_rng(8)
    for _ in range(200):
        corners = (size * rng.uniform(-1, 1, (3, 3))).astype(np.float32)
        facet = np.zeros((1, FACET), dtype=np.float32)
        facet[0, :24].reshape(3, 8)[:, :3] = corners
        weights = rng.dirichlet((1, 1, 1))
        origin = size * rng.uniform(-9, 9, 3)
        direction = weights @ corners.astype(np.float64) - origin
        direction /= np.linalg.norm(direction)
        grazing = abs(np.linalg.det([*(corners[1:].astype(np.float64) - corners[0]), direction * size]))
        b1, b2 = weights_at(facet, 0, *origin, *direction)
        np.testing.assert_allclose((b1, b2), weights[1:], atol=1e-13 * size**3 * 20 / grazing)
        b1, b2 = weights_at(facet, 0, *origin, *rng.normal(size=3))
        assert 0.0 <= b1 <= 1.0
        assert 0.0 <= b2 <= 1.0
        assert b1 + b2 <= 1.0 + 1e-15
    facet[:] = 1.0
    assert weights_at(facet, 0, 0.0, 0.0, 9.0, 0.0, 0.0, -1.0) == (0.0, 0.0)
