"""Parts of a classical building: columns, arches, vaults, balusters, cornices.

Lengths in metres. Columns, piers and balusters stand on y = 0 around the y axis; arches lie in the
x-y plane around x = 0 with their springing line at y = 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from renderer.shapes import Floats, Shape, arc, box, curve, join, lathe, moulding, quad, repeat, surface, tube

FLUTES = 18
PIECES_PER_FLUTE = 4
BASE_RADII = 1.5
"""Height of a column's base over its radius; its capital has `CAPITAL_RADII`."""
CAPITAL_RADII = 2.6


def column(height: float, radius: float) -> Shape:
    """A fluted column with an Attic base and a leafy capital; `radius` is that of the foot of its shaft."""
    shaft = height - (BASE_RADII + CAPITAL_RADII) * radius
    return join(
        _attic_base(radius),
        _fluted_shaft(shaft, radius).moved(0.0, BASE_RADII * radius, 0.0),
        _capital(radius).moved(0.0, height - CAPITAL_RADII * radius, 0.0),
    )


def pier(height: float, half: float) -> Shape:
    """A square pier of half width `half` with a moulded foot and head."""
    foot = [(0.05, 0.0), (0.05, 0.22), (0.02, 0.24), (0.02, 0.28), (0.0, 0.30)]
    head = [(0.0, -0.34), (0.025, -0.32), (0.025, -0.26), (0.0, -0.25), (0.0, -0.16), (0.05, -0.11), (0.07, -0.10),
            (0.07, 0.0), (0.0, 0.0)]  # fmt: skip
    outline = [*foot, *((out, height + up) for out, up in head)]
    return square(outline, half, half)


def square(profile: ArrayLike, half_x: float, half_z: float) -> Shape:
    """A profile (distance out, height) taken around the outside of a rectangle, with mitred corners."""
    corners = [(-half_x, 0.0, half_z), (half_x, 0.0, half_z), (half_x, 0.0, -half_z), (-half_x, 0.0, -half_z)]
    outs = [(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, -1.0), (-1.0, 0.0, -1.0)]
    return join(*(moulding(profile, corners[i - 1], corners[i], outs[i - 1], outs[i]) for i in range(4)))


def square_inside(profile: ArrayLike, half_x: float, half_z: float) -> Shape:
    """A profile (distance inwards, height) taken around the inside of a rectangle, with mitred corners."""
    corners = [(-half_x, 0.0, half_z), (-half_x, 0.0, -half_z), (half_x, 0.0, -half_z), (half_x, 0.0, half_z)]
    ins = [(1.0, 0.0, -1.0), (1.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (-1.0, 0.0, -1.0)]
    return join(*(moulding(profile, corners[i - 1], corners[i], ins[i - 1], ins[i]) for i in range(4)))


def arch_wall(width: float, height: float, radius: float, depth: float, segments: int = 24) -> tuple[Shape, Shape]:
    """A wall `width` by `height` with a semicircular opening at its foot.

    Returns:
        its front and back; and the soffit, rim and feet, which close it.
    """
    opening, frame = _arch_outlines(width, height, radius, segments)
    half = depth / 2
    front = np.stack([frame, opening])
    faces = [surface(_at_depth(front, half), front), surface(_at_depth(front[::-1], -half), front[::-1])]
    soffit = surface(np.stack([_at_depth(opening, half), _at_depth(opening, -half)]))
    rim = np.stack([_at_depth(frame, -half), _at_depth(frame, half)])
    top = np.flatnonzero(frame[:, 1] == height)
    sides = [surface(rim[:, part]) for part in (slice(top[0] + 1), slice(top[0], top[-1] + 1), slice(top[-1], None))]
    foot = (width / 2 - radius, 0.0, 0.0)
    feet = [quad((x, 0.0, -half), foot, (0.0, 0.0, depth)) for x in (-width / 2, radius)]
    return join(*faces), join(soffit, *sides, *feet)


def archivolt(radius: float, width: float, relief: float, segments: int = 24) -> Shape:
    """The stepped band around an arch, standing out by `relief` towards +z, from `radius` outwards."""
    steps = [(0.0, 0.0), (0.0, 0.55), (0.38, 0.55), (0.38, 0.7), (0.72, 0.7), (0.76, 0.85), (0.84, 1.0), (0.94, 1.0),
             (1.0, 0.8), (1.0, 0.0)]  # fmt: skip
    outline = [(radius + width * out, relief * up) for out, up in steps]
    return lathe(outline[::-1], segments, sweep_deg=180.0).turned("x", 90.0)


def groin_vault(span: float, pieces: int = 7) -> Shape:
    """Where two barrel vaults over a square of side `span` cross, seen from below; springs at y = 0."""
    across = np.sin(np.linspace(np.pi / 2, -np.pi / 2, 2 * pieces + 1))
    away = np.sin(np.linspace(0.0, np.pi / 2, pieces + 1))[:, None]
    x = span / 2 * away * np.ones_like(across)
    z = span / 2 * away * across
    y = np.sqrt(np.maximum((span / 2) ** 2 - z * z, 0.0))
    points = np.stack([x, y, z], axis=2)
    web = surface(points, np.stack([x, span / 2 * np.arcsin(np.clip(2 * z / span, -1.0, 1.0))], axis=2))
    return join(*(web.turned("y", quarter) for quarter in (0.0, 90.0, 180.0, 270.0)))


def groin_ribs(span: float, half_width: float, segments: int = 18) -> Shape:
    """The two moulded ribs under the groins of `groin_vault`."""
    t = np.linspace(-math.pi / 2, math.pi / 2, segments + 1)
    path = np.stack([span / 2 * np.sin(t), span / 2 * np.cos(t), span / 2 * np.sin(t)], axis=1)
    rib = tube(path, half_width, half_width, (math.sqrt(0.5), 0.0, -math.sqrt(0.5)), sides=6)
    return join(rib, rib.turned("y", 90.0))


def coffer(side: float, depth: float, border: float) -> Shape:
    """A square coffer in three steps with a rosette, seen from below; its border is at y = 0."""
    half, step = side / 2, (side / 2 - border) / 4
    outline = [(half, 0.0)]
    for level in range(3):
        inset = half - border - level * step
        outline += [(inset, level * depth / 3), (inset, (level + 1) * depth / 3)]
    well = square([(out - half, up) for out, up in reversed(outline)], half, half)
    inner = half - border - 2 * step
    lid = quad((-inner, depth, -inner), (2 * inner, 0.0, 0.0), (0.0, 0.0, 2 * inner))
    return join(well, lid, rosette(0.62 * inner, 0.3 * depth).turned("x", 180.0).moved(0.0, depth, 0.0))


def transverse_arch(radius: float, band: float, width: float, segments: int = 24) -> Shape:
    """A flat band under a barrel vault of `radius` along z, `band` deep and `width` wide."""
    outline = [(radius, width / 2), (radius - band, width / 2), (radius - band, -width / 2), (radius, -width / 2)]
    return lathe(outline, segments, sweep_deg=180.0).turned("x", 90.0)


def rosette(radius: float, relief: float, petals: int = 8) -> Shape:
    """A flower lying on y = 0, open below."""
    angle = 2 * np.pi * np.arange(petals * 2 + 1) / (petals * 2)
    petal = 1.0 - 0.22 * (0.5 - 0.5 * np.cos(petals * angle))
    petal[-1] = petal[0]
    rise = np.array([(1.0, 0.0), (0.86, 0.6), (0.42, 0.30), (0.30, 0.34), (0.22, 0.9), (0.0, 1.0)])
    share = np.clip((rise[:, :1] - 0.3) / 0.4, 0.0, 1.0)
    return lathe(rise * (radius, relief), petals * 2, swell=1.0 + (petal - 1.0) * share)


def baluster(height: float, radius: float, segments: int = 10) -> Shape:
    """A vase-shaped baluster between two square blocks; `radius` is its widest."""
    block = 0.11 * height
    swell = curve((0.34, 0.0), (0.46, 0.05), (0.98, 0.22), (0.92, 0.36), (0.52, 0.66), (0.38, 0.84), pieces=2)
    neck = [(0.62, 0.86), (0.66, 0.90), (0.62, 0.94), (0.42, 0.95), (0.42, 1.0)]
    body = lathe(np.concatenate([swell, neck]) * (radius, height - 2 * block), segments).moved(0.0, block, 0.0)
    foot = box((-0.85 * radius, 0.0, -0.85 * radius), (0.85 * radius, block, 0.85 * radius))
    return join(foot, body, foot.moved(0.0, height - block, 0.0))


def balustrade(length: float, height: float, spacing: float) -> Shape:
    """Balusters between two rails along x, centred."""
    rail, half = 0.1 * height, length / 2
    count = max(2, round(length / spacing))
    x = (np.arange(count) + 0.5) * length / count - half
    balusters = repeat(baluster(height - 2.2 * rail, 0.34 * length / count), [(place, rail, 0.0) for place in x])
    top = [(0.0, 0.0), (0.03, 0.02), (0.03, 0.05), (0.07, 0.08), (0.07, 1.2 * rail), (-0.11, 1.2 * rail)]
    coping = square(top, half, 0.11).moved(0.0, height - 1.2 * rail, 0.0)
    return join(box((-half, 0.0, -0.13), (half, rail, 0.13)), balusters, coping)


def _attic_base(radius: float) -> Shape:
    """Plinth, torus, scotia, torus, fillet."""
    plinth = box((-1.4 * radius, 0.0, -1.4 * radius), (1.4 * radius, 0.38 * radius, 1.4 * radius))
    outline = np.concatenate(
        [
            arc((1.19, 0.59), 0.21, -90.0, 90.0, 6),
            [(1.18, 0.83)],
            arc((1.24, 0.99), 0.15, 250.0, 110.0, 4),
            [(1.15, 1.15)],
            arc((1.12, 1.29), 0.13, -90.0, 90.0, 5),
            [(1.08, 1.44), (1.0, BASE_RADII)],
        ]
    )
    return join(plinth, lathe(outline * radius, 20))


def _fluted_shaft(height: float, radius: float) -> Shape:
    """A shaft with entasis whose flutes start and end in round niches, an astragal on top."""
    flute = np.array([0.0, 0.72, 1.0, 0.72])
    depth = np.append(np.tile(flute, FLUTES), 0.0)
    rise = np.array([0.0, 0.03, 0.045, 0.06, 0.35, 0.65, 0.925, 0.94, 0.955])
    fade = np.array([0.0, 0.0, 0.7, 1.0, 1.0, 1.0, 1.0, 0.7, 0.0])
    taper = 1.0 - 0.15 * rise**1.7
    shaft = lathe(
        np.stack([radius * taper, height * rise], axis=1),
        FLUTES * PIECES_PER_FLUTE,
        swell=1.0 - 0.085 * fade[:, None] * depth,
    )
    top = radius * taper[-1]
    neck = 0.98 * top
    ring = arc((top, 0.09 * radius), 0.07 * radius, -80.0, 90.0, 4)
    outline = np.concatenate([[(top, 0.0)], ring, [(neck, 0.16 * radius), (neck, 0.045 * height)]])
    return join(shaft, lathe(outline, 24).moved(0.0, 0.955 * height, 0.0))


def _capital(radius: float) -> Shape:
    """A bell with two tiers of leaves, corner volutes and an abacus with hollow sides."""
    bell = lathe(curve((0.84, 0.0), (0.86, 0.9), (0.95, 1.6), (1.22, 2.15), pieces=2) * radius, 20)
    low = _leaf(0.86 * radius, 1.05 * radius, 0.34 * radius)
    high = _leaf(0.88 * radius, 1.75 * radius, 0.34 * radius)
    leaves = [low.turned("y", 45.0 * i) for i in range(8)] + [high.turned("y", 45.0 * i + 22.5) for i in range(8)]
    volutes = [_volute(radius).turned("y", 45.0 + 90.0 * i) for i in range(4)]
    return join(bell, *leaves, *volutes, _abacus(radius).moved(0.0, 2.15 * radius, 0.0))


def _leaf(foot: float, height: float, half_width: float) -> Shape:
    """A leaf that clings to a bell in +x and curls outwards at its tip."""
    path = curve((foot, 0.0), (foot + 0.10 * height, 0.55 * height), (foot + 0.32 * height, 0.98 * height),
                 (foot + 0.46 * height, 0.90 * height), (foot + 0.42 * height, 0.78 * height), pieces=2)  # fmt: skip
    width = half_width * np.array([0.75, 0.95, 1.0, 0.95, 0.85, 0.75, 0.6, 0.5, 0.3])
    line = np.stack([path[:, 0], path[:, 1], np.zeros(len(path))], axis=1)
    return tube(line, width, 0.16 * half_width, (0.0, 0.0, 1.0), sides=4)


def _volute(radius: float) -> Shape:
    """A stem in the x-y plane that rolls up under a corner of the abacus."""
    turn = np.radians(np.linspace(150.0, -300.0, 11))
    grow = np.linspace(0.30, 0.07, 11)
    spiral = np.stack([1.28 + grow * np.cos(turn), 1.84 + grow * np.sin(turn)], axis=1)
    path = np.concatenate([[(0.86, 1.0), (0.90, 1.5)], spiral]) * radius
    line = np.stack([path[:, 0], path[:, 1], np.zeros(len(path))], axis=1)
    return tube(line, 0.15 * radius, 0.055 * radius, (0.0, 0.0, 1.0), sides=6)


def _abacus(radius: float) -> Shape:
    """A slab whose four sides are hollow, its corners over the volutes."""
    segments = 40
    angle = (360.0 * np.arange(segments + 1) / segments + 45.0) % 90.0 - 45.0
    slope = np.tan(np.radians(np.abs(angle)))
    reach = np.minimum((0.82 + 0.20 * slope**2) * np.sqrt(1.0 + slope**2), 1.38)
    outline = [(0.0, 0.0), (1.25, 0.0), (1.25, 0.16), (1.36, 0.28), (1.36, 0.45), (0.0, 0.45)]
    return lathe(np.array(outline) * radius, segments, swell=reach)


def _arch_outlines(width: float, height: float, radius: float, segments: int) -> tuple[Floats, Floats]:
    """(k, 2) points of the opening, right to left, and of the frame on the same rays from the centre."""
    corner = math.atan2(height, width / 2)
    angle = np.unique(np.concatenate([np.linspace(0.0, math.pi, segments + 1), [corner, math.pi - corner]]))
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    direction[[0, -1], 1] = 0.0
    to_side = (width / 2) / np.maximum(np.abs(direction[:, 0]), 1e-12)
    to_top = height / np.maximum(direction[:, 1], 1e-12)
    frame = direction * np.minimum(to_side, to_top)[:, None]
    frame[to_top <= to_side * (1.0 + 1e-12), 1] = height
    return radius * direction, frame


def _at_depth(points: Floats, z: float) -> Floats:
    return np.concatenate([points, np.full((*points.shape[:-1], 1), z)], axis=-1)
