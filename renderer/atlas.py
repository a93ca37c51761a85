"""All pictures of a scene in one array, each with smaller copies of itself for places where it is seen small."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula, kernel
from renderer.scene import WRAPS, Texture
from renderer.texture import srgb_to_linear
from renderer.tonemap import FIRST_CODES, THRESHOLDS, srgb_code

PICTURE = np.dtype(
    [
        ("start", np.int64),
        ("width", np.int64),
        ("height", np.int64),
        ("levels", np.int64),
        ("texels", np.float64),
        ("wrap_u", np.int64),
        ("wrap_v", np.int64),
    ]
)
"""One level of a picture: its first texel, its size, and, the same for all its levels, how many levels there
are, the number of texels of the largest, and rows of WRAPS."""


CODE_STEPS = 127.5
"""Codes of a normal map from 0 to the largest component."""


class Reading(NamedTuple):
    """A texture, and what its codes stand for.

    Attributes:
        texture: the picture.
        normals: components of normals in place of colours.
    """

    texture: Texture
    normals: bool = False


WHITE = Reading(Texture(np.full((1, 1, 3), 255, dtype=np.uint8), "white"))
FLAT = Reading(Texture(np.array([[[128, 128, 255]]], dtype=np.uint8), "flat"), normals=True)
WHITE_ROW, FLAT_ROW = -2, -1
"""What surfaces without a texture, or without a normal map, look up where these are forced on, and where it is, from
the end of every atlas: forced on or not, effects look up the same texels."""


class TextureAtlas(NamedTuple):
    """Pictures one after another, each followed by its smaller levels, down to one texel; WHITE and FLAT at the end.

    Attributes:
        texels: (n,) uint32 codes, red | green << 8 | blue << 16 | opacity << 24, row by row, row 0 of each
            picture at the top; smaller levels have no opacity.
        pictures: (k,) PICTURE, the levels of each picture in a row, the largest first.
        linear: (256,) float64 linear light of each sRGB code (IEC 61966-2-1).
        signed: (256,) float64 component of a normal, -1 to 1, of each code of a normal map.
    """

    texels: NDArray[np.uint32]
    pictures: NDArray[np.void]
    linear: NDArray[np.float64]
    signed: NDArray[np.float64]


def normal_components() -> NDArray[np.float64]:
    """(256,) float64 what each code of a normal map stands for: 2c - 1, but 0 for both codes around the middle.

    No code is exactly the middle, and files take either for a flat place.
    """
    signed = np.arange(256) / CODE_STEPS - 1.0
    signed[127:129] = 0.0
    return signed


def build_atlas(readings: list[Reading]) -> tuple[TextureAtlas, dict[Reading, int]]:
    """Lay textures one after another with their smaller levels; also the row of each one's largest level."""
    linear, signed = srgb_to_linear(np.arange(256) / 255), normal_components()
    texels: list[NDArray[np.uint32]] = []
    rows: list[tuple[int, int, int, int, float, int, int]] = []
    row_of = {}
    start = 0
    for reading in (*readings, WHITE, FLAT):
        row_of[reading] = len(rows)
        texture = reading.texture
        levels = _levels(texture, signed if reading.normals else linear, reading.normals)
        wraps = WRAPS.index(texture.wrap_u), WRAPS.index(texture.wrap_v)
        for level in levels:
            height, width = level.shape
            rows.append((start, width, height, len(levels), float(levels[0].size), *wraps))
            texels.append(level.ravel())
            start += level.size
    return TextureAtlas(np.concatenate(texels), np.array(rows, dtype=PICTURE), linear, signed), row_of


def _levels(texture: Texture, decoded: NDArray[np.float64], normals: bool) -> list[NDArray[np.uint32]]:
    """(h, w) uint32 codes of a texture, and of each half of it down to one texel; arguments as of `shrink`."""
    colours = texture.pixels.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], dtype=np.uint32)
    levels = [colours | (texture.opacity.astype(np.uint32) << np.uint32(24))]
    while levels[-1].size > 1:
        height, width = levels[-1].shape
        levels.append(np.zeros((max(1, height // 2), max(1, width // 2)), dtype=np.uint32))
        shrink(levels[-2], decoded, normals, THRESHOLDS, FIRST_CODES, levels[-1])
    return levels


@formula
def _code(value: float, normals: bool, thresholds: NDArray[np.float32], first_codes: NDArray[np.int32]) -> int:
    """The code of a mean."""
    if normals:
        return int(CODE_STEPS * value + CODE_STEPS + 0.5)
    return int(srgb_code(np.float32(value), thresholds, first_codes))


@kernel
def shrink(
    texels: NDArray[np.uint32],
    decoded: NDArray[np.float64],
    normals: bool,
    thresholds: NDArray[np.float32],
    first_codes: NDArray[np.int32],
    smaller: NDArray[np.uint32],
) -> None:
    """Fill a picture with the mean linear light, or the mean normal, of a larger one over each of its texels.

    Args:
        texels: (h, w) uint32 codes of the larger one.
        decoded: (256,) float64 linear light, or component of a normal, of each code.
        normals: whether it holds normals.
        thresholds, first_codes: of `tonemap`.
        smaller: (h2, w2) uint32, written; its texels need not hold whole texels of the larger one.
    """
    height, width = texels.shape
    rows, columns = smaller.shape
    tall, wide = height / rows, width / columns
    for row in range(rows):
        top, bottom = row * tall, min((row + 1) * tall, float(height))
        for column in range(columns):
            left, right = column * wide, min((column + 1) * wide, float(width))
            red, green, blue = 0.0, 0.0, 0.0
            for y in range(int(top), int(np.ceil(bottom))):
                down = min(bottom, y + 1.0) - max(top, float(y))
                for x in range(int(left), int(np.ceil(right))):
                    share = down * (min(right, x + 1.0) - max(left, float(x)))
                    code = texels[y, x]
                    red += share * decoded[code & 255]
                    green += share * decoded[(code >> 8) & 255]
                    blue += share * decoded[(code >> 16) & 255]
            area = (bottom - top) * (right - left)
            r = _code(red / area, normals, thresholds, first_codes)
            g = _code(green / area, normals, thresholds, first_codes)
            b = _code(blue / area, normals, thresholds, first_codes)
            smaller[row, column] = np.uint32(r | (g << 8) | (b << 16))
