"""A two-storey Renaissance courtyard in the morning sun: the benchmark scene.

Five by six bays of columns and arches around a fountain, vaulted walks below, coffered ones above;
`courtyard` builds them, this file furnishes and lights them. The camera looks towards -z.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.scene import Material, Mesh, PointLight, Scene, Surroundings
from renderer.scenes import architecture, courtyard, ornament, patterns
from renderer.scenes.courtyard import (
    ACROSS,
    ALONG,
    ARCH_RADIUS,
    BAY,
    BAYS,
    COURT,
    HALF_X,
    HALF_Z,
    OUTER_X,
    OUTER_Z,
    ROOF,
    SPRING,
    UPPER_FLOOR,
    around,
    at,
    ring,
    steps,
)
from renderer.scenes.patterns import textured
from renderer.shapes import ball, join, repeat, tube

GILT = Material("gilt", (0.50, 0.33, 0.10), specular=(0.9, 0.65, 0.25), shininess=35.0)
WATER = Material("water", (0.02, 0.06, 0.07), (0.6, 0.6, 0.6), 400.0, reflection=(0.35, 0.37, 0.40))

SUN_WAY = (-0.44, 0.80, 0.36)
"""From the middle of the court towards the sun."""
SUN_DISTANCE_M = 90.0
SUNLIGHT = (4.6, 3.95, 3.0)
"""Irradiance of the sun in the court [W/m^2]."""


def atrium() -> Scene:
    """The scene, about 480,000 triangles."""
    sun = np.array(SUN_WAY) / np.linalg.norm(SUN_WAY) * SUN_DISTANCE_M
    red, green, blue = (part * SUN_DISTANCE_M**2 for part in SUNLIGHT)
    return Scene(
        meshes=(*courtyard.structure(), *courtyard.ceilings(), *_floors(), *_walls(), *_furniture()),
        lights=(
            PointLight((float(sun[0]), float(sun[1]), float(sun[2])), (red, green, blue)),
            PointLight((0.5, 4.6, 1.0), (23.0, 19.5, 16.0), casts_shadows=False),
        ),
        surroundings=Surroundings(zenith=(0.16, 0.34, 0.78), horizon=(0.56, 0.70, 0.90), ambient=(0.085, 0.10, 0.135)),
        camera=Camera(position=(-1.6, 1.6, 8.6), look_at=(2.4, 3.8, -9.0), vertical_fov_deg=56.0),
        exposure=1.15,
        title="Atrium: a two-storey arcaded courtyard in the sun",
    )


def _floors() -> list[Mesh]:
    """Polished inlay in the middle of the court, paving around it, steps, the floors of the walks, the roof."""
    stones = (
        patterns.marble((226, 216, 196), (150, 130, 110), 31),
        patterns.marble((236, 230, 220), (140, 140, 146), 32),
        patterns.marble((46, 84, 70), (150, 180, 160), 33),
        patterns.marble((128, 48, 38), (196, 140, 120), 34),
    )
    polished = replace(textured("polished inlay", patterns.parquet(stones)), reflection=(0.10, 0.10, 0.10))
    border = textured("green marble", stones[2])
    flags = [(206, 190, 162), (192, 172, 142), (214, 202, 178), (184, 170, 150)]
    paving = textured("paving", patterns.masonry(flags, (120, 106, 88), 6, 4, 35))
    chequer = patterns.inlay(stones[1:3], _chequer(512))
    stairs = [(0.80, COURT), (0.80, COURT / 2), (0.45, COURT / 2), (0.45, 0.0), (-0.45, 0.0)]
    edge = (HALF_X - 0.45, HALF_Z - 0.45)
    return [
        ring((4.5, 6.0), (0.0, 0.0), COURT).mesh(polished, 1.5),
        ring((5.0, 6.5), (4.5, 6.0), COURT).mesh(border, 1.5),
        ring((HALF_X, HALF_Z), (5.0, 6.5), COURT).mesh(paving, 2.4),
        architecture.square_inside(stairs, HALF_X, HALF_Z).mesh(textured("steps", stones[0]), 2.0),
        ring((OUTER_X, OUTER_Z), (HALF_X + 0.45, HALF_Z + 0.45), 0.0).mesh(textured("chequer", chequer), 1.2),
        ring((OUTER_X, OUTER_Z), edge, UPPER_FLOOR).mesh(paving, 2.4, name="upper floor"),
        ring((OUTER_X, OUTER_Z), edge, ROOF).mesh(paving, 2.4, name="roof"),
    ]


def _walls() -> list[Mesh]:
    """The outer walls with pilasters, doors and framed frescoes."""
    tones = [(214, 190, 152), (204, 178, 138), (220, 200, 166)]
    ashlar = textured("ashlar", patterns.masonry(tones, (150, 128, 100), 6, 3, 41, joint_px=5))
    red = textured("red stucco", patterns.plaster((158, 66, 48), 42, 0.14))
    dado = [(0.10, 0.0), (0.10, 0.85), (0.14, 0.90), (0.14, 0.98), (0.0, 1.0)]
    frame, leaves = ornament.door(1.35, 2.75)
    doors = (steps(3, 2 * BAY), steps(3, 2 * BAY))
    piers = [(x, z) for x in steps(ACROSS + 1) for z in (-OUTER_Z, OUTER_Z)]
    piers += [(x, z) for x in (-OUTER_X, OUTER_X) for z in steps(ALONG + 1)]
    border, canvas = (part.moved(0.0, UPPER_FLOOR + 2.7, -BAY) for part in ornament.picture(1.9, 1.5))
    trim = join(
        architecture.square_inside(dado, OUTER_X, OUTER_Z),
        architecture.square_inside(dado, OUTER_X, OUTER_Z).moved(0.0, UPPER_FLOOR, 0.0),
        at(architecture.pier(SPRING, 0.2), piers, 0.0),
        around(frame.moved(0.0, 0.0, 0.1 - BAY), *doors),
    )
    return [
        architecture.square_inside([(0.0, 0.0), (0.0, UPPER_FLOOR)], OUTER_X, OUTER_Z).mesh(ashlar, 2.4),
        architecture.square_inside([(0.0, UPPER_FLOOR), (0.0, ROOF)], OUTER_X, OUTER_Z).mesh(red, 3.0),
        trim.mesh(textured("wall stone", patterns.marble((214, 204, 186), (170, 152, 130), 43, strength=0.6)), 2.0),
        around(leaves.moved(0.0, 0.0, 0.1 - BAY), *doors).mesh(
            textured("oak", patterns.wood((142, 96, 58), (74, 44, 24), 44)), 1.2
        ),
        around(border, *BAYS).mesh(GILT, 1.0),
        around(canvas, *BAYS).mesh(textured("fresco", patterns.landscape(45)), 1.0),
    ]


def _furniture() -> list[Mesh]:
    """Fountain, statues, orange trees, lanterns and banners."""
    trees = [(x, z) for x in (-5.9, 5.9) for z in (-6.9, 6.9)] + [(-5.9, 0.0), (5.9, 0.0)]
    pedestals = [(x, z) for x in (-5.75, 5.75) for z in (-3.0, 3.0)]
    figure = ornament.statue(1.95)
    figures = join(*(figure.turned("y", 90.0 if x < 0 else -90.0).moved(x, COURT + 1.1, z) for x, z in pedestals))
    fruit = repeat(
        ball(0.055, 8), [(0.56 * math.cos(i * 2.4), 0.12 * i - 0.45, 0.56 * math.sin(i * 2.4)) for i in range(9)]
    )
    crown = ornament.foliage(0.72, 500, 0.23)
    trunk = tube([(0.0, 0.4, 0.0), (0.02, 0.9, 0.0), (0.0, 1.6, 0.0)], 0.05, 0.05, (0.0, 0.0, 1.0))
    cloth = ornament.banner(1.5, 2.6).moved(0.0, UPPER_FLOOR - 0.05, 0.72)
    marble = textured("statuary marble", patterns.marble((216, 208, 196), (176, 168, 160), 51, strength=0.5))
    return [
        join(ornament.fountain_stone(1.9), at(ornament.pedestal(1.1, 0.42), pedestals, 0.0))
        .moved(0.0, COURT, 0.0)
        .mesh(marble, 1.5),
        figures.mesh(marble, 1.5, name="statues"),
        ornament.fountain_water(1.9).moved(0.0, COURT, 0.0).mesh(WATER),
        at(ornament.pot(0.8), trees, COURT).mesh(Material("terracotta", (0.52, 0.22, 0.12))),
        at(trunk, trees, COURT).mesh(Material("bark", (0.16, 0.10, 0.06))),
        at(crown, trees, COURT + 2.05).mesh(Material("leaves", (0.10, 0.24, 0.06), (0.06, 0.06, 0.05), 20.0)),
        at(fruit, trees, COURT + 2.05).mesh(Material("oranges", (0.85, 0.32, 0.03), (0.1, 0.1, 0.1), 30.0)),
        around(ornament.lantern(0.75).moved(0.0, SPRING + ARCH_RADIUS, 0.0), *BAYS).mesh(GILT),
        around(cloth, [], steps(3, 2 * BAY)).mesh(
            textured("banner", patterns.starry((150, 18, 26), (238, 190, 70), 4, 52))
        ),
    ]


def _chequer(side_px: int) -> NDArray[np.int64]:
    """(side_px, side_px) 0 or 1 in two by two fields."""
    field = np.arange(side_px) * 2 // side_px
    return field[:, None] ^ field
