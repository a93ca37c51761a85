"""Textures: looked up bilinearly in linear light, between two sizes of the picture where it is seen small."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula

REPEAT, CLAMP, MIRROR = 0, 1, 2
"""Rows of `renderer.scene.WRAPS`."""

SHARPNESS = 0.5
"""By how many levels a picture is taken larger than its texels fill the footprint: the bilinear filter blurs by
about as much. Least error against the mean over the cell for noise and checks."""


def srgb_to_linear(coded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light, 0..1, of sRGB-coded values, 0..1, any shape (IEC 61966-2-1)."""
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


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
def within(coordinate: float, mode: int) -> float:
    """Where in a picture, 0 to 1, a texture coordinate lies; 0 for one that is not a number.

    Args:
        coordinate: any.
        mode: REPEAT, CLAMP or MIRROR, which runs every second repeat backwards.
    """
    if mode == REPEAT:
        return wrap(coordinate)
    if mode == CLAMP:
        return min(1.0, coordinate) if coordinate > 0.0 else 0.0
    part = 2.0 * wrap(0.5 * coordinate)
    return 2.0 - part if part > 1.0 else part


@formula
def neighbours(position: float, length: int, mode: int) -> tuple[int, int, float]:
    """The two texels around a position along one axis, and the share of the second.

    Args:
        position: in texels, 0 to `length`.
        length: of the picture.
        mode: REPEAT, CLAMP or MIRROR.
    """
    floor = np.floor(position - 0.5)
    share = position - 0.5 - floor
    first = int(floor)
    second = first + 1
    if first < 0:
        first = length - 1 if mode == REPEAT else 0
    elif first >= length:
        first = 0 if mode == REPEAT else length - 1
    if second >= length:
        second = 0 if mode == REPEAT else length - 1
    return first, second, share


@formula
def look_up(
    texels: NDArray[np.uint32],
    linear: NDArray[np.float64],
    pictures: NDArray[np.void],
    row: int,
    across: float,
    down: float,
    wrap_u: int,
    wrap_v: int,
) -> tuple[float, float, float]:
    """Bilinear linear-light colour at a place of one level of a picture; texel centres at half-integers.

    Args:
        texels, linear, pictures: of the atlas.
        row: of the level among `pictures`.
        across, down: share of its width and height, 0 to 1, from its upper left.
        wrap_u, wrap_v: REPEAT, CLAMP or MIRROR.
    """
    picture = pictures[row]
    width, height = picture.width, picture.height
    left, right, fx = neighbours(across * width, width, wrap_u)
    top, bottom, fy = neighbours(down * height, height, wrap_v)
    upper, lower = picture.start + top * width, picture.start + bottom * width
    a, b = texels[upper + left], texels[upper + right]
    c, d = texels[lower + left], texels[lower + right]
    wa, wb, wc, wd = (1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy
    red = wa * linear[a & 255] + wb * linear[b & 255] + wc * linear[c & 255] + wd * linear[d & 255]
    a, b, c, d = a >> 8, b >> 8, c >> 8, d >> 8
    green = wa * linear[a & 255] + wb * linear[b & 255] + wc * linear[c & 255] + wd * linear[d & 255]
    a, b, c, d = a >> 8, b >> 8, c >> 8, d >> 8
    blue = wa * linear[a & 255] + wb * linear[b & 255] + wc * linear[c & 255] + wd * linear[d & 255]
    return red, green, blue


@formula
def opacity(texels: NDArray[np.uint32], pictures: NDArray[np.void], row: int, u: float, v: float) -> float:
    """Bilinear alpha, 0 to 1, at (u, v) of the largest level of a picture.

    Args:
        texels, pictures: of the atlas.
        row: of that level among `pictures`.
    """
    picture = pictures[row]
    width, height = picture.width, picture.height
    left, right, fx = neighbours(within(u, picture.wrap_u) * width, width, picture.wrap_u)
    top, bottom, fy = neighbours((1.0 - within(v, picture.wrap_v)) * height, height, picture.wrap_v)
    upper, lower = picture.start + top * width, picture.start + bottom * width
    above = (1 - fx) * (texels[upper + left] >> 24) + fx * (texels[upper + right] >> 24)
    below = (1 - fx) * (texels[lower + left] >> 24) + fx * (texels[lower + right] >> 24)
    return float(((1 - fy) * above + fy * below) / 255.0)


@formula
def level_of(area: float, texels: float) -> float:
    """Level of a picture whose texels are about as large as a footprint; 0 or less where they are larger.

    Args:
        area: of the footprint in texture coordinates; NaN counts as 0.
        texels: of the picture's largest level.
    """
    covered = area * texels
    if not covered > 1.0:
        return 0.0
    return 0.5 * math.log2(covered) - SHARPNESS


@formula
def filtered(
    texels: NDArray[np.uint32],
    linear: NDArray[np.float64],
    pictures: NDArray[np.void],
    row: int,
    area: float,
    u: float,
    v: float,
) -> tuple[float, float, float]:
    """Colour at (u, v) of a picture as it is seen by a footprint: between the two levels next to its size.

    Args:
        texels, linear, pictures: of the atlas; its `signed` in place of `linear` for a normal map.
        row: of the picture's largest level.
        area: of the footprint in texture coordinates.
    """
    picture = pictures[row]
    wrap_u, wrap_v = picture.wrap_u, picture.wrap_v
    across, down = within(u, wrap_u), 1.0 - within(v, wrap_v)
    level = min(level_of(area, picture.texels), picture.levels - 1.0)
    whole = int(max(0.0, level))
    red, green, blue = look_up(texels, linear, pictures, row + whole, across, down, wrap_u, wrap_v)
    share = level - whole
    if not share > 0.0:
        return red, green, blue
    r, g, b = look_up(texels, linear, pictures, row + whole + 1, across, down, wrap_u, wrap_v)
    return red + share * (r - red), green + share * (g - green), blue + share * (b - blue)
