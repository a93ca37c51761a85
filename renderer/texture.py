"""Textures: looked up bilinearly in linear light, between two sizes of the picture where it is seen small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bilinear import four_texels
from renderer.gather import entry
from renderer.kernel import formula
from renderer.lanes import anywhere, binary_logarithm, choose, floor, least, most, whole

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
    part = coordinate - floor(coordinate)
    return choose(part >= 1.0, 1.0 - 2.0**-53, choose(part >= 0.0, part, 0.0))


@formula
def within(coordinate: float, mode: int) -> float:
    """Where in a picture, 0 to 1, a texture coordinate lies; 0 for one that is not a number.

    Args:
        coordinate: any; numbers or lanes.
        mode: REPEAT, CLAMP or MIRROR, which runs every second repeat backwards.
    """
    part = wrap(choose(mode == MIRROR, 0.5 * coordinate, coordinate))
    there_and_back = choose(part > 0.5, 2.0 - 2.0 * part, 2.0 * part)
    clamped = choose(coordinate > 0.0, least(1.0, coordinate), 0.0)
    return choose(mode == REPEAT, part, choose(mode == CLAMP, clamped, there_and_back))


@formula
def neighbours(position: float, length: int, mode: int) -> tuple[int, int, float]:
    """The two texels around a position along one axis, and the share of the second.

    Args:
        position: in texels, 0 to `length`; numbers or lanes.
        length: of the picture.
        mode: REPEAT, CLAMP or MIRROR.
    """
    before = floor(position - 0.5)
    first = whole(before)
    second = first + 1
    last = length - 1
    past_end = choose(mode == REPEAT, 0, last)
    first = choose(first < 0, choose(mode == REPEAT, last, 0), choose(first > last, past_end, first))
    second = choose(second > last, past_end, second)
    return first, second, position - 0.5 - before


@formula
def look_up(
    mark: bool,
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
        mark: where to look; elsewhere it is black. This and all but the arrays are lanes.
        texels, linear, pictures: of the atlas.
        row: of the level among `pictures`.
        across, down: share of its width and height, 0 to 1, from its upper left.
        wrap_u, wrap_v: REPEAT, CLAMP or MIRROR.
    """
    start, width, height = entry(pictures["start"], row), entry(pictures["width"], row), entry(pictures["height"], row)
    left, right, fx = neighbours(across * width, width, wrap_u)
    top, bottom, fy = neighbours(down * height, height, wrap_v)
    upper, lower = start + top * width, start + bottom * width
    red, green, blue = four_texels(
        mark, texels, linear, upper + left, upper + right, lower + left, lower + right,
        (1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy,
    )  # fmt: skip
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
        area: of the footprint in texture coordinates; one that is not a number counts as 0. Numbers or lanes.
        texels: of the picture's largest level.
    """
    covered = area * texels
    small = covered > 1.0
    return choose(small, 0.5 * binary_logarithm(choose(small, covered, 1.0)) - SHARPNESS, 0.0)


@formula
def filtered(
    mark: bool,
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
        mark: where to look; elsewhere it is black. This and all but the arrays are lanes.
        texels, linear, pictures: of the atlas; its `signed` in place of `linear` for a normal map.
        row: of the picture's largest level.
        area: of the footprint in texture coordinates.
        u, v: texture coordinates.
    """
    wrap_u, wrap_v = entry(pictures["wrap_u"], row), entry(pictures["wrap_v"], row)
    across, down = within(u, wrap_u), 1.0 - within(v, wrap_v)
    level = least(level_of(area, entry(pictures["texels"], row)), entry(pictures["levels"], row) - 1.0)
    larger = whole(most(0.0, level))
    red, green, blue = look_up(mark, texels, linear, pictures, row + larger, across, down, wrap_u, wrap_v)
    share = level - larger
    between = mark & (share > 0.0)
    if anywhere(between):
        smaller = row + larger + choose(between, 1, 0)
        r, g, b = look_up(between, texels, linear, pictures, smaller, across, down, wrap_u, wrap_v)
        share = choose(between, share, 0.0)
        red, green, blue = red + share * (r - red), green + share * (g - green), blue + share * (b - blue)
    return red, green, blue
