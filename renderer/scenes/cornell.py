"""The Cornell box by its published numbers.

Source: Cornell University Program of Computer Graphics, "Cornell Box Data" (1998): corners in
millimetres, x to the left, z into the box; reflectances here are its spectra as linear Rec.709.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.scene import Material, RectangleLight, Rgb, Scene, Surroundings
from renderer.shapes import Shape, join, surface

Corner = tuple[float, float, float]

METRES = 1e-3
"""The published numbers are millimetres."""

FLOOR = ((552.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 559.2), (549.6, 0.0, 559.2))
CEILING = ((556.0, 548.8, 0.0), (556.0, 548.8, 559.2), (0.0, 548.8, 559.2), (0.0, 548.8, 0.0))
BACK_WALL = ((549.6, 0.0, 559.2), (0.0, 0.0, 559.2), (0.0, 548.8, 559.2), (556.0, 548.8, 559.2))
RIGHT_WALL = ((0.0, 0.0, 559.2), (0.0, 0.0, 0.0), (0.0, 548.8, 0.0), (0.0, 548.8, 559.2))
LEFT_WALL = ((552.8, 0.0, 0.0), (549.6, 0.0, 559.2), (556.0, 548.8, 559.2), (556.0, 548.8, 0.0))
LIGHT = ((343.0, 548.8, 227.0), (343.0, 548.8, 332.0), (213.0, 548.8, 332.0), (213.0, 548.8, 227.0))

SHORT_BLOCK_TOP = ((130.0, 165.0, 65.0), (82.0, 165.0, 225.0), (240.0, 165.0, 272.0), (290.0, 165.0, 114.0))
TALL_BLOCK_TOP = ((423.0, 330.0, 247.0), (265.0, 330.0, 296.0), (314.0, 330.0, 456.0), (472.0, 330.0, 406.0))

WHITE = Material("white", (0.725, 0.71, 0.68))
RED = Material("red", (0.63, 0.065, 0.05))
GREEN = Material("green", (0.14, 0.45, 0.091))

LAMP_RADIANCE: Rgb = (18.4, 15.2, 10.6)
"""Of the lamp [W/(sr m^2)]: its published spectrum as linear Rec.709."""

AMBIENT: Rgb = (0.085, 0.073, 0.062)
"""For the light that comes back from floor and walls, which is not simulated."""


def cornell() -> Scene:
    """The scene: box, two blocks, and the lamp in the ceiling."""
    white = join(_polygon(FLOOR), _ceiling(), _polygon(BACK_WALL))
    blocks = join(_block(SHORT_BLOCK_TOP), _block(TALL_BLOCK_TOP))
    return Scene(
        meshes=(
            white.mesh(WHITE, name="floor, ceiling and back wall"),
            _polygon(LEFT_WALL).mesh(RED, name="left wall"),
            _polygon(RIGHT_WALL).mesh(GREEN, name="right wall"),
            blocks.mesh(WHITE, name="blocks"),
        ),
        lights=(_lamp(),),
        surroundings=Surroundings(ambient=AMBIENT),
        camera=Camera(position=(0.278, 0.273, -0.800), look_at=(0.278, 0.273, 0.0), vertical_fov_deg=39.3),
        exposure=2.3,
        title="Cornell box, by its published numbers",
    )


def _lamp() -> RectangleLight:
    """The lamp, which shines down."""
    corner, along, _, across = (np.array(point) * METRES for point in LIGHT)
    return RectangleLight(_point(corner), _point(along - corner), _point(across - corner), LAMP_RADIANCE)


def _point(vector: NDArray[np.float64]) -> Corner:
    x, y, z = vector.tolist()
    return x, y, z


def _ceiling() -> Shape:
    """The ceiling around the lamp, which fills the hole: four trapezoids."""
    following = [1, 2, 3, 0]
    return join(*(_polygon((CEILING[i], CEILING[j], LIGHT[j], LIGHT[i])) for i, j in enumerate(following)))


def _block(top: tuple[Corner, ...]) -> Shape:
    """A block without its bottom, from its four top corners."""
    ground = [(x, 0.0, z) for x, _, z in top]
    following = [1, 2, 3, 0]
    sides = [_polygon((top[j], top[i], ground[i], ground[j])) for i, j in enumerate(following)]
    return join(_polygon(top), *sides)


def _polygon(corners: tuple[Corner, ...]) -> Shape:
    """Four published corners, counter-clockwise seen from the lit side."""
    a, b, c, d = METRES * np.array(corners)
    return surface(np.array([[a, b], [d, c]]))
