"""Smaller copies of pictures: mean linear light, whatever the size of the picture."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.atlas import Reading, build_atlas
from renderer.scene import Texture
from renderer.texture import srgb_to_linear
from renderer.tonemap import encode_srgb


def levels(pixels: NDArray[np.uint8], normals: bool = False) -> list[NDArray[np.float64]]:
    """(h, w, 3) linear light, or normals, of each level of a picture's copy in an atlas, after the other reading."""
    texture = Texture(pixels)
    atlas, row = build_atlas([Reading(texture, not normals), Reading(texture, normals)])
    found = []
    first = row[Reading(texture, normals)]
    assert first > 0
    decoded = atlas.signed if normals else atlas.linear
    for picture in atlas.pictures[first : first + int(atlas.pictures[first]["levels"])]:
        start, width, height = (int(picture[name]) for name in ("start", "width", "height"))
        words = atlas.texels[start : start + width * height].reshape(height, width)
        found.append(decoded[np.stack([words & 255, words >> 8 & 255, words >> 16 & 255], axis=2)])
    return found


def halved(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the size by way of a common multiple of both sizes: each texel repeated, then means of whole blocks."""
    for axis in (0, 1):
        length = light.shape[axis]
        half = max(1, length // 2)
        light = np.moveaxis(np.repeat(light, half, axis=axis), axis, 0)
        light = np.moveaxis(light.reshape(half, length, *light.shape[1:]).mean(axis=1), 0, axis)
    return light


@pytest.mark.parametrize(("height", "width"), [(1, 1), (8, 8), (5, 3), (1, 7), (9, 16), (37, 2)])
def test_each_level_is_the_mean_of_the_one_before(height: int, width: int) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
    found = levels(pixels)
    np.testing.assert_allclose(found[0], srgb_to_linear(pixels / 255))
    assert found[-1].shape == (1, 1, 3)
    for larger, smaller in itertools.pairwise(found):
        assert smaller.shape[:2] == (max(1, larger.shape[0] // 2), max(1, larger.shape[1] // 2))
        np.testing.assert_array_equal(encode_srgb(smaller), encode_srgb(halved(larger)))


@pytest.mark.parametrize(("height", "width"), [(8, 8), (5, 3), (37, 2)])
def test_levels_of_normals_are_means_of_their_components(height: int, width: int) -> None:
    """To half a code, and around the middle, where two codes are one, to a whole one."""
    pixels = np.random.default_rng(2).integers(0, 256, (height, width, 3), dtype=np.uint8)
    found = levels(pixels, normals=True)
    plain = pixels / 127.5 - 1
    np.testing.assert_allclose(found[0], np.where(np.abs(plain) < 0.004, 0, plain))
    for larger, smaller in itertools.pairwise(found):
        np.testing.assert_allclose(smaller, halved(larger), atol=1.001 / 127.5)
        away = np.abs(smaller) > 0
        np.testing.assert_allclose(smaller[away], halved(larger)[away], atol=0.501 / 127.5)
    for flat in (127, 128):
        assert all((level == (0, 0, 1)).all() for level in levels(np.uint8([[[flat, flat, 255]] * 3] * 5), True))


@pytest.mark.parametrize("code", [0, 1, 7, 128, 254, 255])
def test_one_colour_stays_what_it_is(code: int) -> None:
    for level in levels(np.full((13, 6, 3), code, np.uint8)):
        np.testing.assert_array_equal(level, srgb_to_linear(np.array(code / 255)))


def test_black_and_white_are_averaged_as_light() -> None:
    """Half the light is code 188; a mean of the codes would be 128."""
    checks = np.repeat(np.uint8(255 * (np.indices((8, 8)).sum(axis=0) % 2))[:, :, None], 3, axis=2)
    for level in levels(checks)[1:]:
        np.testing.assert_array_equal(level, srgb_to_linear(np.array(188 / 255)))
