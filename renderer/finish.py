"""What a surface is made of at the point that a ray met: its material's numbers after textures and grain."""

from __future__ import annotations

from typing import NamedTuple


class Finish(NamedTuple):
    """A place on a surface, or LANES of them.

    Attributes:
        kr, kg, kb: diffuse albedo.
        sr, sg, sb: specular: height of Phong's highlight, or Rs of Ashikhmin and Shirley.
        calls: bits of the material table.
        shininess: exponent of Phong's highlight.
        nu, nv: exponents of Ashikhmin and Shirley.
        ux, uy, uz: unit tangent along the grain; any vector where the material has none.
        hx, hy, hz: unit shading normal as it is without the normal map.
    """

    kr: float
    kg: float
    kb: float
    sr: float
    sg: float
    sb: float
    calls: int
    shininess: float
    nu: float
    nv: float
    ux: float
    uy: float
    uz: float
    hx: float
    hy: float
    hz: float
