"""Scenes of any size: hills of so many triangles, so many lamps, mirrors that face one another."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from renderer.camera import Camera
from renderer.scene import Material, Mesh, PointLight, Rgb, Scene

SIDE_M: Final = 20.0
"""Of the hills' square [m]."""

HILL_M: Final = 0.4
"""Height of the hills [m]."""

LAMP_HEIGHT_M: Final = 9.0
ALL_LAMPS: Final = 600.0
"""Intensity of all lamps together [W/sr]."""

ROOM_M: Final = 4.0
MIRRORED: Final = 0.9
"""What the mirrors of the room send back: after 32 of them a thirtieth is left, which can still be seen."""

EARTH: Final = Material("earth", (0.6, 0.5, 0.4))
MIRROR: Final = Material("mirror", (0.1, 0.1, 0.1), reflection=(MIRRORED, MIRRORED, MIRRORED))


def hills(triangles: int, lamps: int = 1) -> Scene:
    """About so many triangles that fill the picture, in the light of lamps that cast shadows."""
    squares = max(1, round(math.sqrt(triangles / 2)))
    return Scene(
        meshes=(_hills(squares),),
        lights=tuple(_lamp(number, lamps) for number in range(lamps)),
        camera=Camera((0.0, 12.0, 6.0), (0.0, 0.0, 0.0), vertical_fov_deg=34.0),
    )


def room_of_mirrors() -> Scene:
    """A closed room from inside: a ray goes on until it may meet no further mirror."""
    low, high = -ROOM_M / 2, ROOM_M / 2
    corners = np.array([(x, y, z) for x in (low, high) for y in (low, high) for z in (low, high)])
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    return Scene(
        meshes=(Mesh(corners, np.array(faces, dtype=np.int32), MIRROR),),
        lights=(PointLight((0.3, 1.2, 0.2), (4.0, 4.0, 4.0)),),
        camera=Camera((0.4, 0.1, 1.5), (-0.5, -0.2, -1.0), vertical_fov_deg=60.0),
    )


def _hills(squares: int) -> Mesh:
    side = np.linspace(-SIDE_M / 2, SIDE_M / 2, squares + 1)
    z, x = np.meshgrid(side, side, indexing="ij")
    y = HILL_M * np.sin(1.7 * x) * np.cos(1.3 * z)
    first = (np.arange(squares)[:, None] * (squares + 1) + np.arange(squares)).ravel()
    next_row = first + squares + 1
    faces = np.stack([first, next_row, first + 1, first + 1, next_row, next_row + 1], axis=1).reshape(-1, 3)
    return Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces.astype(np.int32), EARTH)


def _lamp(number: int, lamps: int) -> PointLight:
    turn = 2 * math.pi * number / lamps
    place: Rgb = (5.0 * math.cos(turn), LAMP_HEIGHT_M, 5.0 * math.sin(turn))
    return PointLight(place, (ALL_LAMPS / lamps,) * 3)
