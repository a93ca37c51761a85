"""The anisotropic Phong model of M. Ashikhmin and P. Shirley (An Anisotropic Phong BRDF Model, 2000).

Its highlight is a power of the cosine between the normal and the half vector h, with one exponent along a
tangent u and another across it. It sends out no more light than arrives, is the same in both directions,
and mirrors more at grazing angles.
"""

from __future__ import annotations

import math

from renderer.kernel import formula
from renderer.lanes import choose, exponential, least, logarithm_beside_one, most, natural_logarithm, root

DIFFUSE_SCALE = 28.0 / (23.0 * math.pi)
"""Of the diffuse term, equation 5: makes an albedo of Rd (1 - Rs) at normal incidence nearly whole."""


@formula
def lobe_power(along: float, across: float, up: float, nu: float, nv: float) -> float:
    """(n.h)^((nu (h.u)^2 + nv (h.v)^2) / (1 - (n.h)^2)), equation 4.

    Where h is near n, n.h comes from 1 - (h.u)^2 - (h.v)^2: so the power keeps its digits for any exponent, and
    is 1 where they meet.

    Args:
        along, across, up: (h.u)^2, (h.v)^2 and n.h, above 0; numbers or lanes.
        nu, nv: exponents.
    """
    square = along + across
    bent = square > 0.0
    small = square < 0.5
    logarithm = choose(small, 0.5 * logarithm_beside_one(bent & small, -square), natural_logarithm(square >= 0.5, up))
    exponent = least(0.0, logarithm / square * (nu * along + nv * across))
    return choose(bent, exponential(bent, exponent), 1.0)


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
        nx, ny, nz: unit shading normal; this and what follows are numbers or lanes.
        ux, uy, uz: unit tangent; any vector, 0 too, where the exponents are equal.
        nu, nv: exponents along and across the tangent.
        lx, ly, lz: unit direction to the light, above the shading normal's horizon.
        vx, vy, vz: unit direction to the eye.

    Returns:
        highlight, schlick, matt.
    """
    toward_light = nx * lx + ny * ly + nz * lz
    toward_eye = most(0.0, nx * vx + ny * vy + nz * vz)
    matt = DIFFUSE_SCALE * matt_share(toward_light) * matt_share(toward_eye) * toward_light
    hx, hy, hz = lx + vx, ly + vy, lz + vz
    length = root(hx * hx + hy * hy + hz * hz)
    up = choose(length > 0.0, (hx * nx + hy * ny + hz * nz) / length, 0.0)
    upright = up > 0.0
    hx, hy, hz = hx / length, hy / length, hz / length
    sx, sy, sz = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
    along = hx * ux + hy * uy + hz * uz
    across = hx * (ny * uz - nz * uy) + hy * (nz * ux - nx * uz) + hz * (nx * uy - ny * ux)
    grained = nu != nv
    along = choose(grained, along * along, sx * sx + sy * sy + sz * sz)
    across = choose(grained, across * across, 0.0)
    half_cosine = least(1.0, 0.5 * length)
    power = lobe_power(along, across, choose(upright, up, 1.0), nu, nv)
    scale = root((nu + 1.0) * (nv + 1.0)) / (8.0 * math.pi)
    highlight = scale * power / half_cosine * (toward_light / most(toward_light, toward_eye))
    return choose(upright, highlight, 0.0), choose(upright, fifth(1.0 - half_cosine), 0.0), matt
