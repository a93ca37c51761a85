"""Textures: all pictures of a scene in one array, looked up bilinearly in linear light."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula
from renderer.scene import Texture

PICTURE = np.dtype([("start", np.int64), ("width", np.int64), ("height", np.int64)])
"""One picture of an atlas: its first texel and its size."""


class TextureAtlas(NamedTuple):
    """Pictures one after another.

    Attributes:
        texels: (n,) uint32 sRGB codes, red | green << 8 | blue << 16, row by row, row 0 of each picture
            at the top.
        pictures: (k,) PICTURE.
        linear: (256,) float64 linear light of each code (IEC 61966-2-1).
    """

    texels: NDArray[np.uint32]
    pictures: NDArray[np.void]
    linear: NDArray[np.float64]


def srgb_to_linear(coded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light, 0..1, of sRGB-coded values, 0..1, any shape (IEC 61966-2-1)."""
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def build_atlas(textures: list[Texture]) -> TextureAtlas:
    """Lay `textures` one after another; k may be 0."""
    pictures = np.zeros(len(textures), dtype=PICTURE)
    start = 0
    for row, texture in enumerate(textures):
        height, width = texture.pixels.shape[:2]
        pictures[row] = (start, width, height)
        start += width * height
    texels = [
        texture.pixels.reshape(-1, 3).astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], dtype=np.uint32)
        for texture in textures
    ]
    return TextureAtlas(
        texels=np.concatenate(texels) if texels else np.zeros(1, dtype=np.uint32),
        pictures=pictures,
        linear=srgb_to_linear(np.arange(256) / 255),
    )


@formula
def wrap(coordinate: float) -> float:
    """The repeat of a texture coordinate in [0, 1); 0 for one that is not finite.

    A tiny negative coordinate would round up to 1 and leave the picture; it belongs to its last texel.
    """
    part = coordinate - np.floor(coordinate)
    if part >= 1.0:
        return 1.0 - 2.0**-53
    return part if part >= 0.0 else 0.0


@formula
def look_up(
    texels: NDArray[np.uint32], linear: NDArray[np.float64], start: int, width: int, height: int, u: float, v: float
) -> tuple[float, float, float]:
    """Bilinear linear-light colour at (u, v) of a picture that repeats; texel centres at half-integers, v up.

    Args:
        texels, linear: of the atlas.
        start, width, height: of the picture.
    """
    x = wrap(u) * width - 0.5
    y = (1.0 - wrap(v)) * height - 0.5
    floor_x, floor_y = np.floor(x), np.floor(y)
    fx, fy = x - floor_x, y - floor_y
    left = int(floor_x) if floor_x >= 0.0 else width - 1
    top = int(floor_y) if floor_y >= 0.0 else height - 1
    top = 0 if top >= height else top
    right = left + 1 if left + 1 < width else 0
    bottom = top + 1 if top + 1 < height else 0
    upper, lower = start + top * width, start + bottom * width
    a, b = texels[upper + left], texels[upper + right]
    c, d = texels[lower + left], texels[lower + right]
    wa, wb, wc, wd = (1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy
    red = wa * linear[a & 255] + wb * linear[b & 255] + wc * linear[c & 255] + wd * linear[d & 255]
    a, b, c, d = a >> 8, b >> 8, c >> 8, d >> 8
    green = wa * linear[a & 255] + wb * linear[b & 255] + wc * linear[c & 255] + wd * linear[d & 255]
    a, b, c, d = a >> 8, b >> 8, c >> 8, d >> 8
    blue = wa * linear[a & 255] + wb * linear[b & 255] + wc * linear[c & 255] + wd * linear[d & 255]
    return red, green, blue
