"""The tangent of a surface at the place that a ray met: along its grain, across its shading normal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.gather import pick
from renderer.kernel import formula
from renderer.lanes import choose, root
from renderer.surface import Surface
from renderer.tangent import tangent_of_normal


@formula
def across_normal(s: Surface, tx: float, ty: float, tz: float) -> tuple[float, float, float]:
    """Unit vector across the shading normal nearest to (tx, ty, tz), or that of the normal's own field where
    there is none. Takes numbers or lanes.
    """
    off = tx * s.nx + ty * s.ny + tz * s.nz
    tx, ty, tz = tx - off * s.nx, ty - off * s.ny, tz - off * s.nz
    square = tx * tx + ty * ty + tz * tz
    known = square > 0.0
    out = choose(s.entering, 1.0, -1.0)
    ox, oy, oz = tangent_of_normal(out * s.nx, out * s.ny, out * s.nz)
    tx, ty, tz = choose(known, tx, ox), choose(known, ty, oy), choose(known, tz, oz)
    inverse = 1.0 / root(tx * tx + ty * ty + tz * tz)
    return tx * inverse, ty * inverse, tz * inverse


@formula
def triangle_tangent(
    tangents: NDArray[np.float32], t: int, b1: float, b2: float, s: Surface
) -> tuple[float, float, float]:
    """Unit tangent of triangle `t` at barycentric weights b1, b2 of its second and third corner."""
    b0 = 1.0 - b1 - b2
    return across_normal(
        s,
        b0 * pick(tangents, t, 0) + b1 * pick(tangents, t, 3) + b2 * pick(tangents, t, 6),
        b0 * pick(tangents, t, 1) + b1 * pick(tangents, t, 4) + b2 * pick(tangents, t, 7),
        b0 * pick(tangents, t, 2) + b1 * pick(tangents, t, 5) + b2 * pick(tangents, t, 8),
    )


@formula
def sphere_tangent(s: Surface) -> tuple[float, float, float]:
    """Unit tangent along the parallel of a sphere; at the poles, where all directions are alike, of their own."""
    return across_normal(s, s.nz, 0.0, -s.nx)
