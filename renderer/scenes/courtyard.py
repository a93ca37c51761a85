"""The building of the atrium: a court of five by six bays with arcades on two storeys.

x runs across the court, z along it, the floor of the walks is y = 0.
"""

from __future__ import annotations

import numpy as np

from renderer.scene import Material, Mesh
from renderer.scenes import architecture, ornament, patterns
from renderer.scenes.patterns import textured
from renderer.shapes import Shape, box, join, lathe, quad, repeat

Place = tuple[float, float]
"""x and z [m]."""

BAY = 3.0
"""Distance between columns, and width of the walks around the court [m]."""
ACROSS, ALONG = 5, 6
"""Bays across and along the court."""
HALF_X, HALF_Z = ACROSS * BAY / 2, ALONG * BAY / 2
"""Half the distances between the column lines [m]."""
OUTER_X, OUTER_Z = HALF_X + BAY, HALF_Z + BAY
"""Half the distances between the outer walls [m]."""

BAYS = ([(i - 2.0) * BAY for i in range(ACROSS)], [(i - 2.5) * BAY for i in range(ALONG)])
"""Middles of the bays across (x) and along (z) the court [m]."""

WALL = 0.5
"""Thickness of the arcades' walls [m]."""
ARCH_RADIUS = (BAY - WALL) / 2

COURT = -0.3
"""Height of the court's floor; the columns stand on 0, two steps above it."""
SPRING = 3.7
"""Height of the lower arches' springing line [m]."""
UPPER_FLOOR = 6.0
RAIL = 0.92
"""Height of the upper balustrade over its floor [m]."""
UPPER_SPRING = 9.55
ROOF = 12.1
"""Height of the top of the upper cornice [m]."""


def structure() -> list[Mesh]:
    """Columns, arches, cornices and balustrades around the court."""
    lower, lower_stone = _arcade(SPRING, 1.72)
    upper, upper_stone = _arcade(UPPER_SPRING, 1.62)
    stone = join(lower_stone, upper_stone, _columns(), _cornices(), _rails(), _parapet())
    return [
        stone.mesh(textured("limestone", patterns.plaster((224, 206, 176), 11, 0.10)), 1.6),
        join(lower, upper).mesh(textured("stucco", patterns.plaster((216, 164, 118), 12, 0.16)), 2.4),
        *_roundels(),
    ]


def _arcade(spring: float, height: float) -> tuple[Shape, Shape]:
    """The walls over the arches of one storey, and their stone: soffits, bands and keystones."""
    faces, rest = architecture.arch_wall(BAY, height, ARCH_RADIUS, WALL)
    band = architecture.archivolt(ARCH_RADIUS, 0.20, 0.07).moved(0.0, 0.0, WALL / 2)
    key = box((-0.10, ARCH_RADIUS - 0.05, WALL / 2), (0.10, height + 0.02, WALL / 2 + 0.12))
    stone = join(rest, band, band.turned("y", 180.0), key)
    return around(faces.moved(0.0, spring, 0.0), *BAYS), around(stone.moved(0.0, spring, 0.0), *BAYS)


def _columns() -> Shape:
    """Columns of both storeys, piers in the corners, pedestals under the upper columns."""
    between = [(x, z) for x in steps(ACROSS - 1) for z in (-HALF_Z, HALF_Z)]
    between += [(x, z) for x in (-HALF_X, HALF_X) for z in steps(ALONG - 1)]
    corners = [(x, z) for x in (-HALF_X, HALF_X) for z in (-HALF_Z, HALF_Z)]
    foot = UPPER_FLOOR + RAIL
    return join(
        at(architecture.column(SPRING, 0.25), between, 0.0),
        at(architecture.column(UPPER_SPRING - foot, 0.20), between, foot),
        at(ornament.pedestal(RAIL, 0.27), between + corners, UPPER_FLOOR),
        at(architecture.pier(SPRING, 0.30), corners, 0.0),
        at(architecture.pier(UPPER_SPRING - foot, 0.26), corners, foot),
    )


def _cornices() -> Shape:
    """The entablatures of both storeys with dentils, and the walls behind them."""
    outline = [(0.03, 0.0), (0.03, 0.09), (0.05, 0.09), (0.05, 0.18), (0.09, 0.22), (0.09, 0.24), (0.03, 0.24),
               (0.03, 0.36), (0.07, 0.40), (0.07, 0.47), (0.20, 0.47), (0.20, 0.51), (0.23, 0.53), (0.27, 0.58),
               (0.27, 0.60), (-WALL, 0.60)]  # fmt: skip
    inner = (HALF_X - WALL / 2, HALF_Z - WALL / 2)
    lower = architecture.square_inside(outline, *inner)
    upper = architecture.square_inside(np.array(outline) * (1.5, 1.55), *inner)
    dentil = box((-0.04, 0.40, 0.07), (0.04, 0.465, 0.16))
    block = box((-0.08, 0.60, 0.10), (0.08, 0.725, 0.29))
    return join(
        lower.moved(0.0, SPRING + 1.70, 0.0),
        upper.moved(0.0, UPPER_SPRING + 1.60, 0.0),
        around(dentil.moved(0.0, SPRING + 1.70, WALL / 2), steps(100, 0.15), steps(120, 0.15)),
        around(block.moved(0.0, UPPER_SPRING + 1.60, WALL / 2), steps(40, 0.375), steps(48, 0.375)),
    )


def _rails() -> Shape:
    """Balustrades between the pedestals of the upper storey."""
    rail = architecture.balustrade(BAY - 0.54, RAIL, 0.30)
    return around(rail.moved(0.0, UPPER_FLOOR, 0.0), *BAYS)


def _parapet() -> Shape:
    """A low wall on the roof, with urns over the columns."""
    outline = [(0.0, 0.0), (0.0, 0.50), (0.06, 0.54), (0.06, 0.62), (-0.36, 0.62), (-0.36, 0.0)]
    wall = architecture.square_inside(outline, HALF_X, HALF_Z).moved(0.0, ROOF - 0.05, 0.0)
    places = [(x, z) for x in steps(ACROSS + 1) for z in (-HALF_Z, HALF_Z)]
    places += [(x, z) for x in (-HALF_X, HALF_X) for z in steps(ALONG - 1)[::2]]
    return join(wall, at(ornament.urn(1.15, 16, 8), places, ROOF + 0.57))


def _roundels() -> list[Mesh]:
    """Glazed discs with a white flower in the spandrels of both storeys."""
    disc = lathe([(0.21, 0.0), (0.21, 0.03), (0.18, 0.045), (0.16, 0.02), (0.0, 0.02)], 24).turned("x", 90.0)
    flower = architecture.rosette(0.13, 0.05).turned("x", 90.0).moved(0.0, 0.0, 0.02)
    white = Material("glazed white", (0.86, 0.85, 0.80), specular=(0.2, 0.2, 0.2), shininess=40.0)
    blue = Material("glazed blue", (0.04, 0.11, 0.34), specular=(0.25, 0.25, 0.25), shininess=40.0)
    meshes = []
    for shape, material in ((disc, blue), (flower, white)):
        pairs = [shape.moved(0.0, spring + 1.28, WALL / 2) for spring in (SPRING, UPPER_SPRING)]
        meshes.append(around(join(*pairs), steps(ACROSS - 1), steps(ALONG - 1)).mesh(material))
    return meshes


def ceilings() -> list[Mesh]:
    """Groin vaults below, coffers above."""
    bays = [(x, z) for x in steps(ACROSS + 2) for z in (-HALF_Z - BAY / 2, HALF_Z + BAY / 2)]
    bays += [(x, z) for x in (-HALF_X - BAY / 2, HALF_X + BAY / 2) for z in steps(ALONG)]
    ribs = at(architecture.groin_ribs(BAY, 0.07), bays, SPRING)
    band = architecture.transverse_arch(BAY / 2, 0.13, 0.36)
    bands = at(band, [(x, z) for x in (-HALF_X - BAY / 2, HALF_X + BAY / 2) for z in steps(ALONG + 1)], SPRING)
    across = [(x, z) for x in steps(ACROSS + 1) for z in (-HALF_Z - BAY / 2, HALF_Z + BAY / 2)]
    bands = join(bands, at(band.turned("y", 90.0), across, SPRING))
    half = BAY / 2
    four = [(i * half / 2, 0.0, k * half / 2) for i in (-1, 1) for k in (-1, 1)]
    coffers = at(repeat(architecture.coffer(half, 0.30, 0.14), four), bays, UPPER_SPRING + 1.70)
    sky = textured("starred vault", patterns.starry((52, 86, 150), (236, 200, 110), 6, 21))
    return [
        at(architecture.groin_vault(BAY), bays, SPRING).mesh(sky, 1.5),
        join(ribs, bands).mesh(textured("vault stone", patterns.plaster((224, 210, 186), 22, 0.10)), 1.6),
        coffers.mesh(textured("walnut", patterns.wood((150, 100, 60), (70, 40, 22), 23)), 1.0),
    ]


def ring(outer: Place, inner: Place, height: float) -> Shape:
    """A level floor between two rectangles of the given half sizes; whole where the inner one is empty."""
    (x, z), (a, b) = outer, inner
    strips = [((-x, b), (x, z)), ((-x, -z), (x, -b)), ((-x, -b), (-a, b)), ((a, -b), (x, b))]
    return join(
        *(
            quad((left, height, near), (right - left, 0.0, 0.0), (0.0, 0.0, far - near))
            for (left, far), (right, near) in strips
            if right > left and near > far
        )
    )


def around(shape: Shape, across: list[float], along: list[float]) -> Shape:
    """Copies of a shape, made for the far side and facing the court, at places along all four sides."""
    return join(
        repeat(shape, [(x, 0.0, -HALF_Z) for x in across]),
        repeat(shape.turned("y", 90.0), [(-HALF_X, 0.0, z) for z in along]),
        repeat(shape.turned("y", 180.0), [(x, 0.0, HALF_Z) for x in across]),
        repeat(shape.turned("y", 270.0), [(HALF_X, 0.0, z) for z in along]),
    )


def at(shape: Shape, places: list[Place], height: float) -> Shape:
    """Copies of a shape at places of the plan, all at one height."""
    return repeat(shape, [(x, height, z) for x, z in places])


def steps(count: int, step: float = BAY) -> list[float]:
    """`count` places `step` apart, centred on 0."""
    return [float((i - (count - 1) / 2) * step) for i in range(count)]
