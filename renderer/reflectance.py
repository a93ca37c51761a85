"""How much of the light from one direction a surface sends into another (Phong)."""

from __future__ import annotations

import math
from typing import Any

from renderer.kernel import formula
from renderer.prepared import SPECULAR
from renderer.surface import Surface

INVERSE_PI = 1.0 / math.pi


@formula
def phong_lobe(s: Surface, lx: float, ly: float, lz: float, vx: float, vy: float, vz: float, shininess: float) -> float:
    """(R.V)^shininess, R the mirror image of the direction to the light; 0 where R faces away from V.

    Args:
        s: the surface.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: direction to the eye, of unit length but for float32 rounding, which a large exponent
            would turn into a factor.
        shininess: exponent, 0 to 1e9.
    """
    twice = 2.0 * (s.nx * lx + s.ny * ly + s.nz * lz)
    cosine = (twice * s.nx - lx) * vx + (twice * s.ny - ly) * vy + (twice * s.nz - lz) * vz
    if not cosine > 0.0:
        return 0.0
    return float(min(1.0, cosine / math.sqrt(vx * vx + vy * vy + vz * vz)) ** shininess)


@formula
def reflectance(
    s: Surface,
    material: Any,
    kr: float,
    kg: float,
    kb: float,
    cosine: float,
    lx: float,
    ly: float,
    lz: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float]:
    """Radiance sent towards (vx, vy, vz) for an irradiance of 1 across the unit direction (lx, ly, lz) to a light.

    Args:
        s: the surface.
        material: its row of the material table.
        kr, kg, kb: diffuse albedo, textures included.
        cosine: of the angle between the light and the shading normal, above 0.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: direction to the eye, of unit length but for float32 rounding.
    """
    matt = cosine * INVERSE_PI
    red, green, blue = kr * matt, kg * matt, kb * matt
    if material.calls & SPECULAR != 0:
        gloss = phong_lobe(s, lx, ly, lz, vx, vy, vz, material.shininess)
        red += material.specular_red * gloss
        green += material.specular_green * gloss
        blue += material.specular_blue * gloss
    return red, green, blue
