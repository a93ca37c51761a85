"""Where in their cells camera rays go, read off the rays themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera import ViewFrame
from renderer.rays import make_rays, rows_of
from renderer.sampling import camera_rays, lattice_order, lattice_step

SCREEN_PX = 32_768


PIXEL_VIEW = ViewFrame(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
"""A view whose ray through the pixel point (x, y) is (x, y, 1)."""


def places(
    cells: list[tuple[int, int, int]],
    samples: int,
    *,
    first: int = 0,
    regular: bool = False,
    points: int | None = None,
    screen: tuple[int, int] = (SCREEN_PX, SCREEN_PX),
) -> NDArray[np.float64]:
    """(cells, samples, 2) places of the camera rays of (x, y, side) cells, in pixels from the cell's corner.

    Of samples first .. first + samples - 1 of `points`, or of no more than that.
    """
    x, y, side = (np.array(column, dtype=np.int32) for column in zip(*cells, strict=True))
    rays = make_rays(len(cells) * samples)
    shifted = PIXEL_VIEW._replace(corner=np.array([-float(x[0]), -float(y[0]), 1.0]))
    points = first + samples if points is None else points
    step, order = lattice_step(points) if regular else 0, lattice_order(points)
    chosen = np.arange(len(cells), dtype=np.int32)
    since, until = np.full_like(chosen, first), np.full_like(chosen, first + samples)
    origin = np.zeros(3, np.float32)
    camera_rays(shifted, origin, *screen, x, y, side, chosen, since, until, points, step, order, rays)
    direction = rows_of(rays.direction).astype(np.float64).reshape(len(cells), samples, 3)
    corner = np.stack([x - x[0], y - y[0]], axis=1)[:, None]
    return direction[..., :2] / direction[..., 2:] - corner
