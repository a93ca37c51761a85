"""How much of the light from one direction a surface sends into another, by either base."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from renderer.ashikhmin_shirley import ashikhmin_shirley, matt_share
from renderer.finish import Finish
from renderer.kernel import formula
from renderer.material_table import MICROFACETS, SPECULAR
from renderer.surface import Surface

INVERSE_PI = 1.0 / math.pi


@formula
def phong_lobe(s: Surface, lx: float, ly: float, lz: float, vx: float, vy: float, vz: float, shininess: float) -> float:
    """(R.V)^shininess, R the mirror image of the direction to the light; 0 where R faces away from V.

    Args:
        s: the surface.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: unit direction to the eye.
        shininess: exponent, 0 to 1e9.
    """
    twice = 2.0 * (s.nx * lx + s.ny * ly + s.nz * lz)
    cosine = (twice * s.nx - lx) * vx + (twice * s.ny - ly) * vy + (twice * s.nz - lz) * vz
    if not cosine > 0.0:
        return 0.0
    return float(min(1.0, cosine) ** shininess)


@formula
def towards_eye(material: Any, dx: float, dy: float, dz: float) -> tuple[float, float, float]:
    """Direction to the eye, of unit length where the material has a highlight.

    A ray's direction is of unit length but for float32 rounding, which a large exponent would turn into a factor.

    Args:
        material: its row of the material table.
        dx, dy, dz: direction of the ray that met it.
    """
    if material.calls & (SPECULAR | MICROFACETS) == 0:
        return -dx, -dy, -dz
    inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
    return -dx * inverse, -dy * inverse, -dz * inverse


@formula
def reflectance(
    s: Surface,
    material: Any,
    finish: Finish,
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
        finish: the material at this place.
        cosine: of the angle between the light and the shading normal, above 0.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: direction `towards_eye`.
    """
    if material.calls & MICROFACETS != 0:
        return _microfacets(s, material, finish, lx, ly, lz, vx, vy, vz)
    matt = cosine * INVERSE_PI
    red, green, blue = finish.kr * matt, finish.kg * matt, finish.kb * matt
    if material.calls & SPECULAR != 0:
        gloss = phong_lobe(s, lx, ly, lz, vx, vy, vz, material.shininess)
        red += finish.sr * gloss
        green += finish.sg * gloss
        blue += finish.sb * gloss
    return red, green, blue


@formula
def _microfacets(
    s: Surface,
    material: Any,
    finish: Finish,
    lx: float,
    ly: float,
    lz: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float]:
    """`reflectance` of the base of Ashikhmin and Shirley."""
    gloss, schlick, matt = ashikhmin_shirley(
        s.nx, s.ny, s.nz, finish.ux, finish.uy, finish.uz,
        np.float64(material.exponent_u), np.float64(material.exponent_v),
        lx, ly, lz, vx, vy, vz,
    )  # fmt: skip
    return (
        gloss * (finish.sr + (1.0 - finish.sr) * schlick) + matt * (1.0 - finish.sr) * finish.kr,
        gloss * (finish.sg + (1.0 - finish.sg) * schlick) + matt * (1.0 - finish.sg) * finish.kg,
        gloss * (finish.sb + (1.0 - finish.sb) * schlick) + matt * (1.0 - finish.sb) * finish.kb,
    )


@formula
def even_light(
    s: Surface, material: Any, finish: Finish, dx: float, dy: float, dz: float
) -> tuple[float, float, float]:
    """Share of a light that comes evenly from everywhere which the surface sends back along a ray.

    Phong's diffuse albedo; for Ashikhmin and Shirley the integral of the diffuse term, and for the highlight
    what it mirrors head-on, Rs.

    Args:
        s: the surface.
        material: its row of the material table.
        finish: the material at this place.
        dx, dy, dz: unit direction of the ray that met it.
    """
    if material.calls & MICROFACETS == 0:
        return finish.kr, finish.kg, finish.kb
    matt = matt_share(max(0.0, -(s.nx * dx + s.ny * dy + s.nz * dz)))
    return (
        finish.sr + (1.0 - finish.sr) * finish.kr * matt,
        finish.sg + (1.0 - finish.sg) * finish.kg * matt,
        finish.sb + (1.0 - finish.sb) * finish.kb * matt,
    )
