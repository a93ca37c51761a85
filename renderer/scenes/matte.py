"""An island in facets: plain colours, no shadows, nothing that mirrors or lets through.

It calls for no effect at all, so it shows what a frame costs when every ray ends where it first hits.
x runs along the shore, y up, the camera looks towards -z. Some 250 m from end to end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.scene import Material, Mesh, PointLight, Rgb, Scene, Sphere, Surroundings
from renderer.scenes.patterns import clouds, stream
from renderer.shapes import Floats, Shape, arc, ball, box, curve, join, lathe, repeat, surface

CELLS = 150
"""Pairs of facets along each side of the land."""
HALF_M = 150.0
"""Half the side of the square of land and shoal [m]."""
SEA_CELLS = 120
SEA_NEAR_M, SEA_HALF_M = 420.0, 4000.0
"""The sea's facets grow from `SEA_NEAR_M` / 60 at the island to its edge at `SEA_HALF_M` [m]."""

SUN_WAY = (-0.62, 0.55, 0.30)
SKY_WAY = (0.75, 0.50, 0.65)
DISTANCE_M = 4000.0
"""From the island to the two lights [m]."""

LAND: tuple[tuple[str, float, tuple[Rgb, Rgb, Rgb]], ...] = (
    ("sand", 2.2, ((0.78, 0.66, 0.46), (0.74, 0.61, 0.41), (0.80, 0.70, 0.52))),
    ("meadow", 17.0, ((0.34, 0.52, 0.16), (0.40, 0.57, 0.20), (0.29, 0.46, 0.15))),
    ("heath", 28.0, ((0.20, 0.36, 0.17), (0.26, 0.40, 0.19), (0.42, 0.38, 0.22))),
    ("rock", 45.0, ((0.42, 0.37, 0.35), (0.48, 0.43, 0.40), (0.37, 0.33, 0.33))),
    ("snow", 1e3, ((0.86, 0.88, 0.92), (0.80, 0.84, 0.90), (0.90, 0.91, 0.93))),
)
"""What covers the land: name, up to which height [m], its three tints."""

SEA: tuple[Rgb, ...] = ((0.07, 0.30, 0.42), (0.09, 0.34, 0.45), (0.06, 0.26, 0.39), (0.11, 0.38, 0.48))


FIRS: tuple[Rgb, ...] = ((0.09, 0.24, 0.15), (0.12, 0.29, 0.16), (0.07, 0.20, 0.14))
ROUNDS: tuple[Rgb, ...] = ((0.42, 0.50, 0.12), (0.58, 0.46, 0.12), (0.30, 0.44, 0.14))

BUOY = Material("buoy", (0.80, 0.16, 0.06))
BUOYS = ((-27.0, 136.0), (-4.0, 112.0), (52.0, 146.0), (-92.0, 112.0), (104.0, 96.0))
"""x and z of the buoys [m]."""

HOUSES = (
    (-20.0, 62.0, 12.0, 9.0), (-6.0, 70.0, -8.0, 8.0), (8.0, 63.0, 70.0, 9.0), (21.0, 72.0, 5.0, 7.5),
    (-33.0, 72.0, 40.0, 8.0), (-12.0, 52.0, -20.0, 8.0), (16.0, 50.0, 15.0, 10.0), (34.0, 60.0, -30.0, 8.0),
    (-46.0, 60.0, -15.0, 8.5),
)  # fmt: skip
"""x, z [m], turn [deg] and length [m] of each house."""
LIGHTHOUSE = (96.0, 46.0)
BOATS = ((-52.0, 118.0, 20.0), (22.0, 132.0, -35.0), (70.0, 112.0, 60.0), (-112.0, 92.0, 5.0), (130.0, 20.0, -20.0))
"""x, z [m] and turn [deg] of each boat."""
BALLOONS: tuple[tuple[float, float, float, float, tuple[Rgb, Rgb]], ...] = (
    (74.0, 76.0, 60.0, 11.0, ((0.80, 0.20, 0.14), (0.88, 0.80, 0.62))),
    (-88.0, 92.0, -20.0, 13.0, ((0.16, 0.36, 0.62), (0.86, 0.84, 0.78))),
    (118.0, 104.0, -120.0, 14.0, ((0.88, 0.58, 0.12), (0.50, 0.16, 0.36))),
)
"""x, y, z and radius [m] and the two colours of each balloon."""
PUFFS = (
    (-150.0, 96.0, -150.0, 20.0), (-122.0, 92.0, -150.0, 15.0), (-176.0, 92.0, -146.0, 14.0),
    (-148.0, 106.0, -160.0, 13.0), (40.0, 108.0, -190.0, 17.0), (64.0, 105.0, -190.0, 22.0),
    (96.0, 103.0, -186.0, 15.0), (70.0, 117.0, -196.0, 13.0), (210.0, 84.0, -160.0, 17.0),
    (236.0, 81.0, -160.0, 13.0), (-30.0, 86.0, -70.0, 7.0), (-20.0, 85.0, -68.0, 9.0), (-7.0, 84.0, -70.0, 6.0),
)  # fmt: skip
"""x, y, z and size of each ball of cloud [m]."""


def matte() -> Scene:
    """The scene: sea, land, woods, a village with a lighthouse, boats, balloons and clouds."""
    points = _land()
    return Scene(
        meshes=(*_land_meshes(points), *_sea_meshes(), *_woods(points), *_village(points), *_boats(), *_sky()),
        spheres=tuple(Sphere((x, 0.6, z), 1.3, BUOY, casts_shadows=False) for x, z in BUOYS),
        lights=(_far_light(SUN_WAY, (3.0, 2.55, 1.95)), _far_light(SKY_WAY, (0.62, 0.70, 0.95))),
        surroundings=Surroundings(zenith=(0.16, 0.38, 0.74), horizon=(0.60, 0.76, 0.90), ambient=(0.20, 0.23, 0.30)),
        camera=Camera(position=(34.0, 58.0, 262.0), look_at=(2.0, 20.0, 0.0), vertical_fov_deg=37.0),
        exposure=0.95,
        title="Matte: an island in facets, diffuse only",
    )


def _far_light(way: tuple[float, float, float], irradiance: Rgb) -> PointLight:
    """A light so far away that its rays are all but parallel, which gives `irradiance` [W/m^2] on the island."""
    x, y, z = (float(part) for part in np.array(way) / np.linalg.norm(way) * DISTANCE_M)
    red, green, blue = (part * DISTANCE_M**2 for part in irradiance)
    return PointLight((x, y, z), (red, green, blue), casts_shadows=False)


def _land() -> Floats:
    """(CELLS + 1, CELLS + 1, 3) points of the ground, z falling along the rows: a peak, a ridge, a headland."""
    x, z = _jittered(np.linspace(-HALF_M, HALF_M, CELLS + 1), 0.32, 1)
    rough = clouds(CELLS + 1, CELLS + 1, 4, 5, 2)
    ridges = 1.0 - np.abs(2.0 * clouds(CELLS + 1, CELLS + 1, 5, 4, 3) - 1.0)
    island = _hill(x + 5.0, z + 12.0, 138.0, 112.0)
    peak = _hill(x + 34.0, z + 42.0, 84.0, 74.0)
    second = _hill(x - 52.0, z + 36.0, 62.0, 58.0)
    headland = _hill(x - 92.0, z - 42.0, 34.0, 30.0)
    height = -9.0 + 24.0 * np.sqrt(island) + 26.0 * (rough - 0.5) + 14.0 * np.minimum(1.0, 2.0 * headland)
    height += (60.0 * peak + 36.0 * second) * (0.30 + 0.85 * ridges)
    return np.stack([x, np.maximum(height, -6.0), z], axis=2)


def _hill(x: Floats, z: Floats, half_x: float, half_z: float) -> Floats:
    """A smooth bump: 1 in the middle, 0 from an ellipse outwards."""
    return np.maximum(1.0 - (x / half_x) ** 2 - (z / half_z) ** 2, 0.0) ** 2


def _jittered(lines: Floats, share: float, seed: int) -> tuple[Floats, Floats]:
    """x and z of a grid over `lines` whose points stray by up to `share` of a cell; z falls along the rows."""
    n = len(lines)
    stray = share * (2.0 * stream(2 * n * n, seed).reshape(2, n, n) - 1.0)
    cell = np.gradient(lines)
    return lines + stray[0] * cell, (lines + stray[1].T * cell).T[::-1]


def _facets(points: Floats, seed: int) -> tuple[NDArray[np.int64], Floats]:
    """(2m, 3) triangles over a grid, split along random diagonals, and the (2m,) chance that tints each."""
    rows, columns, _ = points.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + 1, corner + columns + 1, corner + columns
    rising = stream(len(corner), seed)[:, None] < 0.5
    first = np.where(rising, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(rising, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    faces = np.stack([first, second], axis=1).reshape(-1, 3)
    return faces, stream(len(faces), seed + 1)


def _land_meshes(points: Floats) -> list[Mesh]:
    """One mesh for each tint of each cover; steep facets are rock."""
    vertices = points.reshape(-1, 3)
    faces, chance = _facets(points, 10)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    steep = normal[:, 1] < 0.66 * np.linalg.norm(normal, axis=1)
    height = corners[:, :, 1].mean(axis=1) + 7.0 * (stream(len(faces), 12) - 0.5) * (corners[:, :, 1].max(axis=1) > 4.0)
    cover = np.searchsorted([top for _, top, _ in LAND], height)
    cover[steep & (cover > 0) & (cover < 4)] = 3
    tint = (3 * chance).astype(np.int64)
    above = corners[:, :, 1].max(axis=1) > -1.0
    return [
        _part(vertices, faces[above & (cover == i) & (tint == k)], Material(name, tints[k]))
        for i, (name, _, tints) in enumerate(LAND)
        for k in range(3)
    ]


def _sea_meshes() -> list[Mesh]:
    """Facets of water, small near the island and large towards the horizon."""
    t = np.linspace(-1.0, 1.0, SEA_CELLS + 1)
    x, z = _jittered(SEA_NEAR_M * t + (SEA_HALF_M - SEA_NEAR_M) * t**5, 0.30, 20)
    waves = 0.7 * (clouds(SEA_CELLS + 1, SEA_CELLS + 1, 40, 2, 21) - 0.5)
    points = np.stack([x, waves, z], axis=2)
    faces, chance = _facets(points, 22)
    tint = (len(SEA) * chance).astype(np.int64)
    return [_part(points.reshape(-1, 3), faces[tint == k], Material("sea", colour)) for k, colour in enumerate(SEA)]


def _part(vertices: Floats, faces: NDArray[np.int64], material: Material) -> Mesh:
    """The faces with the vertices they use, flat."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return Mesh(vertices[used], renumbered.reshape(-1, 3), material, casts_shadows=False, name=material.name)


def _flat(shape: Shape, name: str, colour: Rgb) -> Mesh:
    return Mesh(shape.vertices, shape.faces, Material(name, colour), casts_shadows=False, name=name)


def _woods(points: Floats) -> list[Mesh]:
    """Firs on the slopes, round trees in the meadows, each kind in three greens."""
    ground = points[1:-1, 1:-1].reshape(-1, 3)
    slope = np.maximum(*(np.abs(part)[1:-1, 1:-1].ravel() for part in np.gradient(points[:, :, 1])))
    chance, kind = stream(2 * len(ground), 30).reshape(2, -1)
    thick = clouds(CELLS - 1, CELLS - 1, 6, 3, 31).ravel()
    height = ground[:, 1]
    firs = (height > 7.0) & (height < 36.0) & (slope < 2.6) & (chance < 0.9 * (thick - 0.38))
    rounds = (height > 3.0) & (height < 13.0) & (slope < 1.3) & (chance > 0.2) & (chance < 0.2 + 0.35 * (thick - 0.36))
    return [
        _flat(
            repeat(tree.stretched(size, size, size), ground[chosen & ((3 * kind).astype(np.int64) == k)]),
            name,
            colours[k],
        )
        for chosen, tree, name, colours in ((firs, _fir(), "fir", FIRS), (rounds, _round_tree(), "round tree", ROUNDS))
        for k, size in enumerate((0.85, 1.0, 1.2))
    ]


def _fir() -> Shape:
    """A fir of three cones, 6.4 m high, its foot a little below the ground."""
    tiers = [lathe([(0.0, low), (wide, low), (0.0, top)], 7).turned("y", 25.0 * low)
             for low, wide, top in ((0.3, 1.75, 3.4), (1.9, 1.4, 4.9), (3.4, 1.0, 6.4))]  # fmt: skip
    return join(*tiers)


def _round_tree() -> Shape:
    return ball(1.9, 8).stretched(1.0, 1.15, 1.0).moved(0.0, 2.3, 0.0)


def _village(points: Floats) -> list[Mesh]:
    """Houses on the meadow by the shore, and a lighthouse on the headland."""
    walls, roofs = [], []
    for x, z, turn_deg, length in HOUSES:
        ground = _height_at(points, x, z)
        wall, roof = _house(length)
        walls.append(wall.turned("y", turn_deg).moved(x, ground, z))
        roofs.append(roof.turned("y", turn_deg).moved(x, ground, z))
    x, z = LIGHTHOUSE
    base = _height_at(points, x, z) - 1.0
    bands = [lathe([(2.6 - 0.2 * i, 3.2 * i), (2.4 - 0.2 * i, 3.2 * (i + 1))], 12).moved(x, base, z) for i in range(6)]
    gallery = lathe([(1.4, 19.2), (2.1, 19.2), (2.1, 19.7), (1.2, 19.7), (1.2, 21.4), (1.7, 21.4), (0.0, 23.4)], 12)
    return [
        _flat(join(*walls), "walls", (0.80, 0.74, 0.64)),
        _flat(join(*roofs), "roofs", (0.62, 0.24, 0.15)),
        _flat(join(*bands[::2]), "white bands", (0.84, 0.83, 0.80)),
        _flat(join(*bands[1::2], gallery.moved(x, base, z)), "red bands", (0.66, 0.13, 0.10)),
    ]


def _house(length: float) -> tuple[Shape, Shape]:
    """Walls with gables, and a roof that stands over them; the ridge runs along x."""
    half, depth, eaves, ridge = length / 2, 2.6, 3.4, 5.8
    gable = surface(np.array([[(half, eaves, depth), (half, eaves, -depth)], [(half, ridge, 0.0), (half, ridge, 0.0)]]))
    chimney = box((half - 1.9, eaves, 0.4), (half - 1.0, ridge + 0.8, 1.3))
    over_x, over_z = half + 0.4, depth + 0.5
    drop = eaves - 0.5 * (ridge - eaves) / depth
    slope = surface(
        np.array([[(-over_x, drop, over_z), (over_x, drop, over_z)], [(-over_x, ridge, 0.0), (over_x, ridge, 0.0)]])
    ).moved(0.0, 0.1, 0.0)
    walls = join(box((-half, -3.0, -depth), (half, eaves, depth)), gable, gable.turned("y", 180.0), chimney)
    return walls, join(slope, slope.turned("y", 180.0))


def _height_at(points: Floats, x: float, z: float) -> float:
    """Height of the land's nearest point [m]."""
    away = (points[:, :, 0] - x) ** 2 + (points[:, :, 2] - z) ** 2
    return float(points[:, :, 1].ravel()[np.argmin(away)])


def _boats() -> list[Mesh]:
    """Sailing boats off the shore."""
    hull = lathe(arc((0.0, 0.0), 1.0, -90.0, 0.0, 4), 8).stretched(3.4, 1.3, 1.2).moved(0.0, 0.9, 0.0)
    deck = lathe([(1.0, 0.0), (0.0, 0.0)], 8).stretched(3.4, 1.0, 1.2).moved(0.0, 0.9, 0.0)
    mast = box((0.2, 0.9, -0.08), (0.36, 9.0, 0.08))
    main = surface(np.array([[(-3.0, 1.9, 0.5), (0.2, 1.9, 0.0)], [(0.2, 8.8, 0.0), (0.2, 8.8, 0.0)]]))
    jib = surface(np.array([[(0.4, 1.7, 0.0), (3.4, 1.5, 0.2)], [(0.4, 7.6, 0.0), (0.4, 7.6, 0.0)]]))
    parts = ((join(hull, deck, mast), "hulls", (0.42, 0.20, 0.10)), (join(main, jib), "sails", (0.88, 0.84, 0.74)))
    return [
        _flat(join(*(shape.turned("y", turn_deg).moved(x, 0.0, z) for x, z, turn_deg in BOATS)), name, colour)
        for shape, name, colour in parts
    ]


def _sky() -> list[Mesh]:
    """Balloons in two colours of gores, and clouds."""
    meshes = []
    gores = 12
    outline = curve((0.16, -1.35), (0.75, -0.62), (1.0, 0.12), (0.72, 0.72), (0.0, 1.0), pieces=4)
    gore = lathe(outline, 2, sweep_deg=360.0 / gores)
    basket = box((-0.13, -1.62, -0.13), (0.13, -1.40, 0.13))
    for x, y, z, radius, colours in BALLOONS:
        for k, colour in enumerate(colours):
            half = join(*(gore.turned("y", 360.0 / gores * i) for i in range(k, gores, 2)), *((basket,) if k else ()))
            meshes.append(_flat(half.stretched(radius, radius, radius).moved(x, y, z), "balloon", colour))
    puffs = [ball(radius, 10).stretched(1.5, 0.72, 1.0).moved(x, y, z) for x, y, z, radius in PUFFS]
    return [*meshes, _flat(join(*puffs), "clouds", (0.86, 0.86, 0.88))]
