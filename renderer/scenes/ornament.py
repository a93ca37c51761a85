"""Things that stand in a courtyard: urns, statues, a fountain, orange trees, lanterns, doors.

All in metres, on y = 0 around the y axis unless they say otherwise.
"""

from __future__ import annotations

import math

import numpy as np

from renderer.scenes.architecture import square
from renderer.shapes import Floats, Shape, arc, ball, box, curve, join, lathe, repeat, surface, torus, tube

GOLDEN_ANGLE_DEG = 180.0 * (3.0 - math.sqrt(5.0))
"""Turn between two leaves that never line up [deg]."""


def urn(height: float, segments: int = 32, lobes: int = 16) -> Shape:
    """A lobed urn on a foot, with a lid and two handles."""
    outline = np.concatenate(
        [
            [(0.0, 0.0), (0.24, 0.0), (0.24, 0.04), (0.20, 0.06)],
            curve((0.10, 0.10), (0.07, 0.17), (0.12, 0.23), pieces=3),
            curve((0.20, 0.27), (0.36, 0.42), (0.40, 0.58), (0.33, 0.68), pieces=5),
            curve((0.24, 0.74), (0.25, 0.80), (0.36, 0.85), pieces=3),
            [(0.36, 0.88), (0.30, 0.88)],
            curve((0.26, 0.90), (0.12, 0.94), (0.05, 0.955), pieces=3),
            arc((0.0, 0.975), 0.035, -40.0, 90.0, 4),
        ]
    )
    return join(lathe(outline * height, segments, swell=_lobes(outline, segments, lobes)), _handles(height))


def statue(height: float, segments: int = 40) -> Shape:
    """A draped figure holding a sphere: a robe in folds, shoulders, head, arms."""
    outline = np.concatenate(
        [
            [(0.0, 0.0), (0.17, 0.0)],
            curve((0.175, 0.02), (0.150, 0.20), (0.125, 0.40), (0.105, 0.54), (0.098, 0.60), pieces=5),
            curve((0.118, 0.68), (0.128, 0.76), (0.112, 0.805), (0.050, 0.835), pieces=4),
            [(0.038, 0.850), (0.036, 0.870), (0.0, 0.880)],
        ]
    )
    angle = 2 * np.pi * np.arange(segments + 1) / segments
    sway = 2.4 * outline[:, 1:]
    folds = 0.10 * np.sin(9 * angle + sway) + 0.05 * np.sin(14 * angle - 2 * sway)
    fall = np.clip((0.62 - outline[:, 1:]) / 0.5, 0.0, 1.0)
    flat = 1.0 - 0.16 * np.sin(angle) ** 2
    swell = flat * (1.0 + fall * folds)
    swell[:, -1] = swell[:, 0]
    robe = lathe(outline * height, segments, swell=swell)
    head = ball(0.055 * height, 20).stretched(0.92, 1.25, 1.0).moved(0.0, 0.925 * height, 0.012 * height)
    hair = torus(0.042 * height, 0.02 * height, 20, 10).turned("x", -25.0).moved(0.0, 0.955 * height, -0.01 * height)
    orb = ball(0.05 * height, 20).moved(0.02 * height, 0.66 * height, 0.17 * height)
    return join(robe, head, hair, orb, _arm(height, 1.0), _arm(height, -1.0), _sash(height))


def pedestal(height: float, half: float) -> Shape:
    """A moulded square pedestal."""
    foot = [(0.05, 0.0), (0.05, 0.10), (0.03, 0.13), (0.0, 0.15)]
    head = [(0.0, height - 0.14), (0.03, height - 0.11), (0.05, height - 0.09), (0.05, height), (-half, height)]
    return join(square(foot + head, half, half), _panels(height, half))


def fountain_stone(radius: float, segments: int = 64) -> Shape:
    """A round basin around a stem with two bowls and a pine cone."""
    rim = [(0.94, 0.0), (1.0, 0.0), (1.0, 0.06), (0.95, 0.09), (0.93, 0.13), (0.93, 0.34), (0.98, 0.39), (1.03, 0.41),
           (1.03, 0.47), (0.86, 0.47), (0.86, 0.0)]  # fmt: skip
    basin = lathe(np.array(rim) * (radius, 1.0), segments)
    stem = np.concatenate(
        [
            [(0.34, 0.0), (0.34, 0.30)],
            curve((0.26, 0.36), (0.16, 0.60), (0.22, 0.85), (0.13, 1.08), pieces=4),
            [(0.20, 1.12), (0.20, 1.16)],
        ]
    )
    top = curve((0.12, 1.30), (0.09, 1.50), (0.13, 1.66), (0.09, 1.84), pieces=4)
    return join(
        basin,
        lathe(stem, 32),
        _bowl(0.92, 1.16, segments),
        lathe(top, 32),
        _bowl(0.48, 1.84, 64),
        _cone(0.13, 0.42).moved(0.0, 1.95, 0.0),
    )


def fountain_water(radius: float) -> Shape:
    """The water in the basin and in the two bowls of `fountain_stone`."""
    discs = ((0.87 * radius, 0.36), (0.87, 1.405), (0.45, 1.965))
    return join(*(lathe([(out, up), (0.0, up)], 48) for out, up in discs))


def foliage(radius: float, leaves: int, leaf_m: float) -> Shape:
    """A ball of pointed, folded leaves around the origin."""
    leaf = lathe([(0.0, 0.0), (0.28 * leaf_m, 0.45 * leaf_m), (0.0, leaf_m)], 4).stretched(1.0, 1.0, 0.2)
    index = np.arange(leaves)
    lift = 1.0 - 2.0 * (index + 0.5) / leaves
    angle = np.radians(GOLDEN_ANGLE_DEG) * index
    around = np.sqrt(1.0 - lift * lift)
    outward = np.stack([around * np.cos(angle), lift, around * np.sin(angle)], axis=1)
    reach = radius * (0.80 + 0.20 * np.mod(index * 0.618034, 1.0))
    frames = _leaf_frames(outward, 2 * np.pi * np.mod(index * 0.754878, 1.0))
    turned = (leaf.vertices[None, :, :, None] * frames[:, None]).sum(axis=2)
    normals = (leaf.normals[None, :, :, None] * frames[:, None]).sum(axis=2)
    starts = len(leaf.vertices) * index[:, None, None]
    return Shape(
        (turned + (reach[:, None] * outward)[:, None]).reshape(-1, 3),
        normals.reshape(-1, 3),
        np.tile(leaf.uvs, (leaves, 1)),
        (starts + leaf.faces).reshape(-1, 3),
    )


def pot(height: float) -> Shape:
    """A terracotta pot with a rim and a garland line, filled with earth."""
    outline = [(0.0, 0.0), (0.30, 0.0), (0.34, 0.10), (0.43, 0.62), (0.45, 0.66), (0.43, 0.70), (0.45, 0.84),
               (0.52, 0.86), (0.52, 1.0), (0.44, 1.0), (0.44, 0.92), (0.0, 0.92)]  # fmt: skip
    return lathe(np.array(outline) * height, 36)


def lantern(height: float) -> Shape:
    """A hanging lantern, its hook at the origin."""
    cage = [(0.0, -1.0), (0.06, -0.97), (0.10, -0.90), (0.26, -0.84), (0.26, -0.80), (0.22, -0.78), (0.28, -0.40),
            (0.32, -0.38), (0.32, -0.34), (0.10, -0.20), (0.05, -0.14), (0.05, -0.10), (0.0, -0.08)]  # fmt: skip
    ring = torus(0.05 * height, 0.015 * height, 16, 8).turned("x", 90.0).moved(0.0, -0.05 * height, 0.0)
    return join(lathe(np.array(cage) * height, 8), ring)


def door(width: float, height: float) -> tuple[Shape, Shape]:
    """A double door in the x-y plane facing +z: its stone frame with a cornice; its panelled leaves."""
    band, half = 0.22, width / 2
    sides = [box((x - band / 2, 0.0, 0.0), (x + band / 2, height, 0.12)) for x in (-half - band / 2, half + band / 2)]
    lintel = box((-half - band, height, 0.0), (half + band, height + 0.3, 0.14))
    cornice = [(0.0, 0.0), (0.03, 0.03), (0.10, 0.08), (0.16, 0.10), (0.16, 0.17), (-0.14, 0.2)]
    hood = square(cornice, half + band + 0.02, 0.14).moved(0.0, height + 0.3, 0.0)
    frame = join(*sides, lintel, hood)
    panel = _panel(0.40 * half, 0.40 * height / 4)
    places = [(side * half / 2, (2 * row + 1) * height / 8, 0.04) for side in (-1, 1) for row in range(4)]
    leaves = [box((low, 0.0, 0.0), (low + half - 0.01, height, 0.04)) for low in (-half, 0.01)]
    return frame, join(*leaves, repeat(panel, places))


def banner(width: float, height: float, columns: int = 16, rows: int = 18) -> Shape:
    """A cloth that hangs from a pole at y = 0 in the x-y plane, facing both ways, in soft folds."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    sway = 0.05 * v * np.sin(2.3 * np.pi * u + 1.3 * v) + 0.03 * np.sin(3.0 * v)
    points = np.stack([width * (u - 0.5) * (1.0 - 0.05 * v), -height * v, sway], axis=2)
    uvs = np.stack([u, 1.0 - v], axis=2)
    front = surface(points[::-1], uvs[::-1])
    back = surface(points[::-1, ::-1] - (0.0, 0.0, 0.006), uvs[::-1, ::-1])
    pole = tube([(-0.56 * width, 0.0, 0.0), (0.56 * width, 0.0, 0.0)], 0.03, 0.03, (0.0, 1.0, 0.0))
    return join(front, back, pole)


def picture(width: float, height: float) -> tuple[Shape, Shape]:
    """A moulded frame and the canvas in it, in the x-y plane around the origin, facing +z.

    The canvas has texture coordinates from 0 to 1.
    """
    section = [(0.10, 0.0), (0.10, 0.05), (0.075, 0.075), (0.055, 0.06), (0.03, 0.05), (0.0, 0.035), (0.0, 0.0)]
    frame = square(section, width / 2, height / 2).turned("x", 90.0)
    x, y = width / 2, height / 2
    corners = np.array([[(-x, -y, 0.02), (x, -y, 0.02)], [(-x, y, 0.02), (x, y, 0.02)]])
    uvs = np.array([[(0.0, 0.0), (1.0, 0.0)], [(0.0, 1.0), (1.0, 1.0)]])
    return frame, surface(corners, uvs)


def _panel(half_x: float, half_y: float) -> Shape:
    """A raised and fielded panel facing +z around the origin."""
    inner = -min(half_x, half_y)
    steps = [(0.0, 0.0), (0.0, 0.02), (-0.02, 0.035), (-0.04, 0.02), (-0.05, 0.02), (-0.08, 0.04), (inner, 0.04)]
    return square(steps, half_x, half_y).turned("x", 90.0)


def _panels(height: float, half: float) -> Shape:
    """A panel on each side of a pedestal."""
    panel = _panel(0.72 * half, 0.5 * (height - 0.29) - 0.06).moved(0.0, 0.5 * (height + 0.01), half)
    return join(*(panel.turned("y", 90.0 * quarter) for quarter in range(4)))


def _lobes(outline: Floats, segments: int, lobes: int) -> Floats:
    """Factors that bulge the belly of `urn`."""
    angle = 2 * np.pi * np.arange(segments + 1) / segments
    height = outline[:, 1:]
    belly = np.clip((height - 0.25) / 0.1, 0.0, 1.0) * np.clip((0.68 - height) / 0.1, 0.0, 1.0)
    swell = 1.0 + 0.07 * belly * np.abs(np.sin(lobes / 2 * angle))
    swell[:, -1] = swell[:, 0]
    return swell


def _handles(height: float) -> Shape:
    path = height * curve((0.31, 0.81), (0.47, 0.88), (0.52, 0.72), (0.45, 0.60), (0.37, 0.56), pieces=3)
    line = np.stack([path[:, 0], path[:, 1], np.zeros(len(path))], axis=1)
    handle = tube(line, 0.035 * height, 0.02 * height, (0.0, 0.0, 1.0), sides=6)
    return join(handle, handle.turned("y", 180.0))


def _arm(height: float, side: float) -> Shape:
    path = height * curve((0.105 * side, 0.785, 0.0), (0.15 * side, 0.68, 0.02), (0.13 * side, 0.60, 0.08),
                          (0.05 * side, 0.64, 0.16), pieces=4)  # fmt: skip
    thickness = height * np.linspace(0.038, 0.022, len(path))
    return tube(path, thickness, thickness, (1.0, 0.0, 0.0), sides=10)


def _sash(height: float) -> Shape:
    ring = torus(0.118 * height, 0.014 * height, 32, 8).stretched(1.0, 1.0, 0.86)
    return ring.turned("z", 32.0).moved(0.0, 0.685 * height, 0.0)


def _bowl(radius: float, foot: float, segments: int) -> Shape:
    """A shallow bowl with lobes underneath whose foot is at height `foot`."""
    outline = np.concatenate(
        [
            curve((0.14 / radius, 0.0), (0.5, 0.05), (0.86, 0.16), (0.94, 0.25), pieces=4),
            arc((0.97, 0.275), 0.035, -60.0, 120.0, 5),
            curve((0.92, 0.24), (0.5, 0.14), (0.0, 0.12), pieces=4),
        ]
    )
    angle = 2 * np.pi * np.arange(segments + 1) / segments
    under = np.zeros((len(outline), 1))
    under[2:12] = np.array([0.3, 0.6, 0.9, 1.0, 1.0, 1.0, 0.9, 0.7, 0.4, 0.2])[:, None]
    swell = 1.0 + 0.04 * under * (np.abs(np.sin(segments / 8 * angle)) - 1.0)
    swell[:, -1] = swell[:, 0]
    return lathe(outline * (radius, 1.0), segments, swell=swell).moved(0.0, foot, 0.0)


def _cone(radius: float, height: float) -> Shape:
    """A pine cone with scales in two crossing spirals."""
    rise = np.linspace(0.0, 1.0, 33)
    outline = np.stack([radius * np.sqrt(np.maximum(1.0 - (1.6 * rise - 0.6) ** 2, 0.0)), height * rise], axis=1)
    outline[-1, 0] = 0.0
    angle = 2 * np.pi * np.arange(49) / 48
    turn = 18.0 * rise[:, None]
    swell = 1.0 + 0.10 * np.sin(8 * angle + turn) * np.sin(8 * angle - turn)
    swell[:, -1] = swell[:, 0]
    return lathe(outline, 48, swell=swell)


def _leaf_frames(outward: Floats, spin: Floats) -> Floats:
    """(n, 3, 3) images of the axes of leaves: y half outwards and half along the ball, turned by `spin` [rad]."""
    level = np.stack([-outward[:, 2], np.zeros(len(outward)), outward[:, 0]], axis=1)
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    along = np.cos(spin)[:, None] * level + np.sin(spin)[:, None] * np.cross(outward, level)
    y = (0.5 * outward + along) / math.sqrt(1.25)
    x = np.cross(y, outward)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=1)
