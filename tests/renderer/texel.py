"""Looking up one place of a picture by rendering a square that shows nothing else."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from renderer.pipeline import Renderer
from renderer.scene import Material, Scene, Surroundings, Texture
from renderer.texture import srgb_to_linear
from tests.renderer.drawing import WHITE, aim, quad, shoot

AMBIENT = Surroundings(ambient=WHITE)


def picture(rows: list[list[int]]) -> Texture:
    """A grey picture of codes."""
    return Texture(np.repeat(np.array(rows, dtype=np.uint8)[:, :, None], 3, axis=2))


def linear(code: float) -> float:
    return float(srgb_to_linear(np.array(code / 255)))


def look_up(renderer: Renderer, texture: Texture, u: float, v: float) -> NDArray[np.float32]:
    """Colour at (u, v) as a material of albedo 1 shows it under ambient light 1."""
    square = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), Material("picture", diffuse=WHITE, diffuse_texture=texture))
    square = dataclasses.replace(square, uvs=np.tile((u, v), (4, 1)).astype(np.float64))
    scene = Scene(meshes=(square,), surroundings=AMBIENT, camera=aim((0, 0, 2), (0.1, 0.1, 0)))
    return np.asarray(shoot(renderer, scene).pixels[0, 0], dtype=np.float32)


def srgb_of(linear: float) -> float:
    """IEC 61966-2-1, 0 to 1."""
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
