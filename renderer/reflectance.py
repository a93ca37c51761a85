"""How much of the light from one direction a surface sends into another, by either base.

All of it takes numbers or lanes.
"""

from __future__ import annotations

import math

from renderer.ashikhmin_shirley import ashikhmin_shirley, matt_share
from renderer.finish import Finish
from renderer.kernel import formula
from renderer.lanes import anywhere, choose, least, most, power, root
from renderer.material_table import MICROFACETS, SPECULAR
from renderer.surface import Surface

INVERSE_PI = 1.0 / math.pi

FAINT = 150.0 * math.log(2.0)
"""c^n is at most e^(-n (1 - c)); where that is less than 2^-150 float32 has it as 0, and it is not worked out."""


@formula
def phong_lobe(
    shiny: bool, s: Surface, lx: float, ly: float, lz: float, vx: float, vy: float, vz: float, shininess: float
) -> float:
    """(R.V)^shininess, R the mirror image of the direction to the light; 0 where R faces away from V, or it is FAINT.

    Args:
        shiny: whether to work it out; else it is 0.
        s: the surface.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: unit direction to the eye.
        shininess: exponent, 0 to 1e9.
    """
    twice = 2.0 * (s.nx * lx + s.ny * ly + s.nz * lz)
    cosine = (twice * s.nx - lx) * vx + (twice * s.ny - ly) * vy + (twice * s.nz - lz) * vz
    there = (cosine > 0.0) & (shininess * (1.0 - cosine) < FAINT)
    return power(shiny & there, least(1.0, cosine), shininess)


@formula
def towards_eye(calls: int, dx: float, dy: float, dz: float) -> tuple[float, float, float]:
    """Direction to the eye, of unit length where the material has a highlight.

    A ray's direction is of unit length but for float32 rounding, which a large exponent would turn into a factor.

    Args:
        calls: bits of the material table.
        dx, dy, dz: direction of the ray that met it.
    """
    shines = calls & (SPECULAR | MICROFACETS) != 0
    if anywhere(shines):
        inverse = choose(shines, 1.0 / root(dx * dx + dy * dy + dz * dz), 1.0)
        return -dx * inverse, -dy * inverse, -dz * inverse
    return -dx, -dy, -dz


@formula
def reflectance(
    s: Surface,
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
        finish: the material at this place.
        cosine: of the angle between the light and the shading normal; where it is not above 0 the result has no
            meaning.
        lx, ly, lz: unit direction to the light.
        vx, vy, vz: direction `towards_eye`.
    """
    matt = cosine * INVERSE_PI
    red, green, blue = finish.kr * matt, finish.kg * matt, finish.kb * matt
    shiny = finish.calls & SPECULAR != 0
    if anywhere(shiny):
        gloss = phong_lobe(shiny, s, lx, ly, lz, vx, vy, vz, finish.shininess)
        red, green, blue = red + finish.sr * gloss, green + finish.sg * gloss, blue + finish.sb * gloss
    faceted = finish.calls & MICROFACETS != 0
    if anywhere(faceted):
        r, g, b = _microfacets(s, finish, lx, ly, lz, vx, vy, vz)
        red, green, blue = choose(faceted, r, red), choose(faceted, g, green), choose(faceted, b, blue)
    return red, green, blue


@formula
def _microfacets(
    s: Surface,
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
        s.nx, s.ny, s.nz, finish.ux, finish.uy, finish.uz, finish.nu, finish.nv, lx, ly, lz, vx, vy, vz
    )
    return (
        gloss * (finish.sr + (1.0 - finish.sr) * schlick) + matt * (1.0 - finish.sr) * finish.kr,
        gloss * (finish.sg + (1.0 - finish.sg) * schlick) + matt * (1.0 - finish.sg) * finish.kg,
        gloss * (finish.sb + (1.0 - finish.sb) * schlick) + matt * (1.0 - finish.sb) * finish.kb,
    )


@formula
def even_light(s: Surface, finish: Finish, dx: float, dy: float, dz: float) -> tuple[float, float, float]:
    """Share of a light that comes evenly from everywhere which the surface sends back along a ray.

    Phong's diffuse albedo; for Ashikhmin and Shirley the integral of the diffuse term, and for the highlight
    what it mirrors head-on, Rs.

    Args:
        s: the surface.
        finish: the material at this place.
        dx, dy, dz: unit direction of the ray that met it.
    """
    faceted = finish.calls & MICROFACETS != 0
    if not anywhere(faceted):
        return finish.kr, finish.kg, finish.kb
    matt = matt_share(most(0.0, -(s.nx * dx + s.ny * dy + s.nz * dz)))
    return (
        choose(faceted, finish.sr + (1.0 - finish.sr) * finish.kr * matt, finish.kr),
        choose(faceted, finish.sg + (1.0 - finish.sg) * finish.kg * matt, finish.kg),
        choose(faceted, finish.sb + (1.0 - finish.sb) * finish.kb * matt, finish.kb),
    )
