"""The anisotropic Phong model of M. Ashikhmin and P. Shirley (An Anisotropic Phong BRDF Model, 2000).

Its highlight is a power of the cosine between the normal and the half vector h, with one exponent along a
tangent u and another across it. It sends out no more light than arrives, is the same in both directions,
and mirrors more at grazing angles.
"""

from __future__ import annotations

import math

from renderer.kernel import formula

DIFFUSE_SCALE = 28.0 / (23.0 * math.pi)
"""Of the diffuse term, equation 5: makes an albedo of Rd (1 - Rs) at normal incidence nearly whole."""


@formula
def lobe_power(along: float, across: float, up: float, nu: float, nv: float) -> float:
    """(n.h)^((nu (h.u)^2 + nv (h.v)^2) / (1 - (n.h)^2)), equation 4.

    Where h is near n, n.h comes from 1 - (h.u)^2 - (h.v)^2: so the power keeps its digits for any exponent, and
    is 1 where they meet.

    Args:
        along, across, up: (h.u)^2, (h.v)^2 and n.h, above 0.
        nu, nv: exponents.
    """
    square = along + across
    if not square > 0.0:
        return 1.0
    logarithm = 0.5 * math.log1p(-square) if square < 0.5 else math.log(up)
    return math.exp(min(0.0, logarithm / square * (nu * along + nv * across)))


@formula
def fifth(x: float) -> float:
    """x^5."""
    square = x * x
    return square * square * x


@formula
def matt_share(cosine: float) -> float:
    """1 - (1 - cosine/2)^5: how much of the light from one direction the diffuse term takes, equation 5."""
    return 1.0 - fifth(1.0 - 0.5 * cosine)


@formula
def ashikhmin_shirley(
    nx: float, ny: float, nz: float, ux: float, uy: float, uz: float, nu: float, nv: float,
    lx: float, ly: float, lz: float, vx: float, vy: float, vz: float,
) -> tuple[float, float, float]:  # fmt: skip
    """The terms of the model that do not depend on colour: f N.L = highlight * F + matt * Rd (1 - Rs) with
    F = Rs + (1 - Rs) * schlick. They include N.L, without which the highlight has no bound at grazing angles.

    An eye below the shading normal's horizon counts as on it. Where the light stands right behind the eye's
    ray, h has no direction and there is no highlight.

    Args:
        nx, ny, nz: unit shading normal.
        ux, uy, uz: unit tangent; any vector, 0 too, where the exponents are equal.
        nu, nv: exponents along and across the tangent.
        lx, ly, lz: unit direction to the light, above the shading normal's horizon.
        vx, vy, vz: unit direction to the eye.

    Returns:
        highlight, schlick, matt.
    """
    toward_light = nx * lx + ny * ly + nz * lz
    toward_eye = max(0.0, nx * vx + ny * vy + nz * vz)
    matt = DIFFUSE_SCALE * matt_share(toward_light) * matt_share(toward_eye) * toward_light
    hx, hy, hz = lx + vx, ly + vy, lz + vz
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    up = (hx * nx + hy * ny + hz * nz) / length if length > 0.0 else 0.0
    if not up > 0.0:
        return 0.0, 0.0, matt
    hx, hy, hz = hx / length, hy / length, hz / length
    sx, sy, sz = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
    along_squared, across_squared = sx * sx + sy * sy + sz * sz, 0.0
    if nu != nv:
        along = hx * ux + hy * uy + hz * uz
        across = hx * (ny * uz - nz * uy) + hy * (nz * ux - nx * uz) + hz * (nx * uy - ny * ux)
        along_squared, across_squared = along * along, across * across
    half_cosine = min(1.0, 0.5 * length)
    power = lobe_power(along_squared, across_squared, up, nu, nv)
    scale = math.sqrt((nu + 1.0) * (nv + 1.0)) / (8.0 * math.pi)
    highlight = scale * power / half_cosine * (toward_light / max(toward_light, toward_eye))
    return highlight, fifth(1.0 - half_cosine), matt
