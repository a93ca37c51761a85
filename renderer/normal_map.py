"""Normal maps: surfaces that look as if they had bumps.

A texel (red, green, blue) stands for the components of a normal along the texture coordinate u, along v, and
out of the surface: 2c - 1 for each code c from 0 to 1, no sRGB decoding, as in glTF 2.0 (section 3.9.3). The
two codes around the middle, 127 and 128, both stand for exactly 0, and nothing points into the surface.
Components are filtered like colours, the mean over the footprint of the ray, and the result has unit length
again.

A bent normal b may still face away from the ray, or mirror it into the surface. It is then pulled towards the
normal h that it was bent from, to b + t h with the least t that will do. With v against the ray, B = b.v,
G = b.h and V = h.v > 0:

- to face the ray takes t = -B / V; the surface is then seen edge-on;
- to mirror it no deeper than along the plane of h takes the larger root of V t^2 + 2 B t + (2 B G - V) = 0,
  where the product with v is the root of the discriminant, so that it faces the ray as well.

Lights need the former only, mirror rays the latter. Where h itself leans away from the ray, as on the outline
of a smooth mesh, the face's own normal takes its place.
"""

from __future__ import annotations

from renderer.kernel import formula
from renderer.lanes import choose, most, root
from renderer.surface import Surface


@formula
def _with_normal(s: Surface, nx: float, ny: float, nz: float) -> Surface:
    """The surface with another shading normal, of any length; one without length leaves it as it is."""
    square = nx * nx + ny * ny + nz * nz
    known = square > 0.0
    inverse = 1.0 / root(square)
    nx, ny, nz = choose(known, nx * inverse, s.nx), choose(known, ny * inverse, s.ny), choose(known, nz * inverse, s.nz)
    return Surface(
        s.px, s.py, s.pz, s.gx, s.gy, s.gz, nx, ny, nz, s.u, s.v, s.offset, s.lift, s.material, s.entering
    )  # fmt: skip


@formula
def _facing(
    s: Surface, hx: float, hy: float, hz: float, dx: float, dy: float, dz: float
) -> tuple[float, float, float, float]:
    """The normal to pull towards, h or else the face's own, and how much it faces the ray."""
    facing = -(dx * hx + dy * hy + dz * hz)
    seen = facing > 0.0
    return (
        choose(seen, hx, s.gx),
        choose(seen, hy, s.gy),
        choose(seen, hz, s.gz),
        choose(seen, facing, -(dx * s.gx + dy * s.gy + dz * s.gz)),
    )


@formula
def bumped(
    s: Surface, tx: float, ty: float, tz: float, x: float, y: float, z: float, dx: float, dy: float, dz: float
) -> Surface:
    """The surface with its shading normal n bent by a normal map; it faces the ray.

    Args:
        s: the surface; this and what follows are numbers or lanes.
        tx, ty, tz: unit vector t across n.
        x, y, z: components of the bent normal along t, along n x t, and along n, of any length.
        dx, dy, dz: direction of the ray that met it.
    """
    z = most(0.0, z)
    bx = x * tx + y * (s.ny * tz - s.nz * ty) + z * s.nx
    by = x * ty + y * (s.nz * tx - s.nx * tz) + z * s.ny
    bz = x * tz + y * (s.nx * ty - s.ny * tx) + z * s.nz
    toward = -(dx * bx + dy * by + dz * bz)
    away = toward < 0.0
    hx, hy, hz, facing = _facing(s, s.nx, s.ny, s.nz, dx, dy, dz)
    bx = choose(away, facing * bx - toward * hx, bx)
    by = choose(away, facing * by - toward * hy, by)
    bz = choose(away, facing * bz - toward * hz, bz)
    return _with_normal(s, bx, by, bz)


@formula
def mirroring(s: Surface, hx: float, hy: float, hz: float, dx: float, dy: float, dz: float) -> Surface:
    """A surface that `bumped` bent from the unit normal h, with a normal that mirrors the ray off it."""
    bent = (s.nx != hx) | (s.ny != hy) | (s.nz != hz)
    hx, hy, hz, facing = _facing(s, hx, hy, hz, dx, dy, dz)
    toward = -(dx * s.nx + dy * s.ny + dz * s.nz)
    upright = s.nx * hx + s.ny * hy + s.nz * hz
    pull = root(most(0.0, toward * toward + facing * facing - 2.0 * toward * upright * facing)) - toward
    pulled = bent & (pull > 0.0)
    return _with_normal(
        s,
        choose(pulled, facing * s.nx + pull * hx, 0.0),
        choose(pulled, facing * s.ny + pull * hy, 0.0),
        choose(pulled, facing * s.nz + pull * hz, 0.0),
    )
