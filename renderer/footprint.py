"""How wide a ray is: the patch of a surface that its share of a cell covers, which picks the size of a texture.

A ray carries the width of its pencil and how fast that grows. Both have a sign: behind a focus the pencil is
upside down. Flat mirrors leave the growth as it is; on spheres it follows the paraxial equations of optics
(Hecht, Optics, ch. 5). Meshes count as flat. Amanatides (Ray Tracing with Cones, 1984) began it; the level of a
texture comes from the area of the footprint, as its shape is not kept (Akenine-Moller et al., Texture
Level-of-Detail Strategies for Real-Time Ray Tracing, 2019).
"""

from __future__ import annotations

import math

from renderer.kernel import formula
from renderer.lanes import root, size
from renderer.surface import Surface


@formula
def pencil_spread(side: int, points: int, pixel: float, inverse: float) -> float:
    """Growth of the width of a camera ray with distance: the side of a square that covers its share of its cell.

    The samples of a cell share its area, so that more of them sharpen.

    Args:
        side: of the cell [px].
        points: samples that the cell gets in the end.
        pixel: side of a pixel at distance 1 along the view.
        inverse: 1 over the distance to the pixel, in the same units, at most 1.
    """
    return side * (pixel / math.sqrt(points)) * inverse * root(inverse)


@formula
def covered_area(s: Surface, width: float, density: float, dx: float, dy: float, dz: float) -> float:
    """Area in texture coordinates of the patch of a surface that a ray covers.

    Args:
        s: the surface; this and what follows are numbers or lanes.
        width: of the ray where they meet, in scene units.
        density: texture coordinates per scene unit, the geometric mean of both directions.
        dx, dy, dz: unit direction of the ray.
    """
    across = width * density
    return across * across / size(s.gx * dx + s.gy * dy + s.gz * dz)


@formula
def mirrored_spread(spread: float, width: float, curvature: float) -> float:
    """Growth of a ray's width after a mirror; `curvature` is 1/radius, above 0 where the mirror bulges out."""
    return spread + 2.0 * curvature * width


@formula
def refracted_spread(spread: float, width: float, curvature: float, eta: float) -> float:
    """Growth of a ray's width behind a boundary; eta is the index before it over that behind."""
    return eta * spread - (1.0 - eta) * curvature * width
