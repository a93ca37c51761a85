"""Procedural textures: (h, w, 3) uint8 sRGB arrays, row 0 at the top; all but the paintings tile seamlessly.

They are mixed in sRGB from sums, products, quotients and square roots of a fixed random stream alone,
so they come out the same to the last bit on every platform. Colours are 0 to 255.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.scene import Material, Texture
from renderer.shapes import Floats

Pixels = NDArray[np.uint8]
Colour = tuple[float, float, float]


def textured(name: str, pixels: Pixels) -> Material:
    """A matte material that shows `pixels`."""
    return Material(name, (0.95, 0.95, 0.95), diffuse_texture=Texture(pixels, name))


def checkerboard(light: Colour, dark: Colour, side_px: int = 512) -> Pixels:
    """Two by two fields, `light` at the bottom left."""
    across = np.arange(side_px) >= side_px // 2
    is_light = across[:, None] != across
    return _mix(dark, light, is_light.astype(np.float64))


def plaster(colour: Colour, seed: int, contrast: float = 0.08, side_px: int = 256) -> Pixels:
    """A plain surface, lightly mottled: brightness varies by `contrast` either way."""
    tone = 1.0 + 2 * contrast * (clouds(side_px, side_px, 4, 5, seed) - 0.5)
    return _bytes(tone[:, :, None] * np.asarray(colour))


def marble(ground: Colour, vein: Colour, seed: int, side_px: int = 512, strength: float = 1.0) -> Pixels:
    """Polished stone with veins where a warped field crosses its middle, fine veins between them."""
    broad = _vein(clouds(side_px, side_px, 3, 6, seed), 0.030)
    fine = _vein(clouds(side_px, side_px, 6, 5, seed + 1), 0.018)
    haze = clouds(side_px, side_px, 4, 4, seed + 2)
    return _mix(ground, vein, strength * np.clip(0.75 * broad + 0.35 * fine + 0.35 * (haze - 0.3), 0.0, 1.0))


def masonry(
    colours: Sequence[Colour],
    joint: Colour,
    courses: int,
    bricks: int,
    seed: int,
    side_px: int = 512,
    joint_px: int = 4,
) -> Pixels:
    """`courses` rows of `bricks` blocks, every second row shifted by half a block; an even number of courses.

    Each block takes one of the `colours`, a little lighter or darker, with a lit upper edge.
    """
    y, x = np.arange(side_px)[:, None], np.arange(side_px)[None, :]
    course = y * courses // side_px
    shift = (course % 2) * (side_px // bricks // 2)
    brick = ((x + shift) % side_px) * bricks // side_px
    down = y - course * side_px // courses
    along = (x + shift) % side_px - brick * side_px // bricks
    number = course * bricks + brick
    chance = stream(2 * courses * bricks, seed)
    palette = np.asarray(colours)
    choice = (chance[: courses * bricks] * len(palette)).astype(np.int64)
    tone = 0.88 + 0.24 * chance[courses * bricks :][number] + 0.16 * (clouds(side_px, side_px, 8, 4, seed + 1) - 0.5)
    stone = palette[choice[number]] * (tone + 0.06 * (down == joint_px))[:, :, None]
    in_joint = (down < joint_px) | (along < joint_px)
    return _bytes(np.where(in_joint[:, :, None], np.asarray(joint), stone))


def wood(light: Colour, dark: Colour, seed: int, planks: int = 4, side_px: int = 512) -> Pixels:
    """Planks whose grain runs along u, each with rings, fibres and a tone of its own."""
    plank = np.arange(side_px) * planks // side_px
    chance = stream(planks, seed)
    drift = np.roll(clouds(side_px, side_px, 2, 3, seed + 1), side_px // 3, axis=1)
    height = np.arange(side_px)[:, None] / side_px
    rings = _wave(3 * planks * height + 4.0 * drift + 7.0 * chance[plank][:, None])
    fibres = _stretched_clouds(side_px, seed + 2)
    share = 0.2 + 0.22 * rings + 0.38 * fibres + 0.3 * (chance[plank][:, None] - 0.5)
    gap = (np.arange(side_px) % (side_px // planks) < 2)[:, None]
    return _mix(light, dark, np.clip(np.where(gap, 1.3, share), 0.0, 1.3))


def inlay(panels: Sequence[Pixels], cell: NDArray[np.integer]) -> Pixels:
    """A mosaic: pixel (y, x) comes from `panels[cell[y, x]]`, all of the size of `cell`."""
    mosaic = panels[0].copy()
    for number, panel in enumerate(panels[1:], 1):
        here = cell == number
        mosaic[here] = panel[here]
    return mosaic


def starry(ground: Colour, star: Colour, across: int, seed: int, side_px: int = 512) -> Pixels:
    """A ground with `across` by `across` four-pointed stars, large and small by turns."""
    y, x = np.meshgrid(*2 * [((np.arange(side_px) + 0.5) * across / side_px) % 1.0 - 0.5], indexing="ij")
    turn = (np.arange(side_px) * across // side_px) % 2
    size = np.where(turn[:, None] == turn, 0.62, 0.42)
    inside = np.clip((size - np.sqrt(np.abs(x)) - np.sqrt(np.abs(y))) * 20.0, 0.0, 1.0)
    tone = 0.85 + 0.3 * clouds(side_px, side_px, 4, 5, seed)
    return _bytes(tone[:, :, None] * _mix(ground, star, inside))


def landscape(seed: int, width_px: int = 512, height_px: int = 384) -> Pixels:
    """A painted view: evening sky with clouds, a sun, five ranges of hills one before the other."""
    y = (np.arange(height_px)[:, None] + 0.5) / height_px
    x = (np.arange(width_px)[None, :] + 0.5) / width_px
    fog = clouds(height_px, width_px, 3, 6, seed)
    low, high, cloud = (np.array(c) for c in ((244.0, 196.0, 132.0), (84.0, 128.0, 172.0), (250.0, 236.0, 214.0)))
    picture = high + (low - high) * np.clip(1.5 * y, 0.0, 1.0)[:, :, None]
    picture = picture + (cloud - picture) * (0.9 * np.clip(3.0 * fog - 1.5, 0.0, 1.0))[:, :, None]
    sun_x, sun_y = 0.25 + 0.5 * stream(2, seed)
    disc = ((x - sun_x) * width_px / height_px) ** 2 + (y - 0.6 * sun_y) ** 2 < 0.06**2
    picture[disc] = (255.0, 240.0, 196.0)
    far, near = np.array((150.0, 142.0, 158.0)), np.array((36.0, 58.0, 34.0))
    shade = 0.75 + 0.5 * clouds(height_px, width_px, 16, 3, seed + 1)
    for layer in range(5):
        crest = 0.48 + 0.11 * layer + 0.20 * (clouds(1, width_px, 2 + layer, 4, seed + 7 * layer + 1) - 0.5)
        hill = (far + (near - far) * layer / 4) * np.roll(shade, 97 * layer, axis=1)[:, :, None]
        picture = np.where((y > crest)[:, :, None], hill, picture)
    return _bytes(picture)


def composition(seed: int, width_px: int = 384, height_px: int = 384) -> Pixels:
    """An abstract painting: fields of flat colour between black bars."""
    white = (236, 232, 220)
    palette = np.array([white, white, (196, 30, 28), (238, 196, 32), (28, 62, 140), (214, 212, 204)])
    chance = stream(64, seed)
    cuts_x, cuts_y = (np.sort(0.08 + 0.84 * part) for part in (chance[:4], chance[4:8]))
    x, y = (np.arange(width_px) + 0.5) / width_px, (np.arange(height_px) + 0.5) / height_px
    field = 5 * np.searchsorted(cuts_y, y)[:, None] + np.searchsorted(cuts_x, x)
    colours = palette[(chance[8:33][field] * len(palette)).astype(np.int64)]
    bar = (np.abs(x[:, None] - cuts_x).min(axis=1) < 0.011) | (np.abs(y[:, None] - cuts_y).min(axis=1) < 0.011)[:, None]
    return _bytes(np.where(bar[:, :, None], 22.0, colours))


def parquet(panels: Sequence[Pixels]) -> Pixels:
    """One tile of stone inlay from four stones: a disc in a star in a diamond, on a ground."""
    side_px = len(panels[0])
    y, x = np.meshgrid(*2 * [np.abs((np.arange(side_px) + 0.5) * 2.0 / side_px - 1.0)], indexing="ij")
    diamond, square, disc = x + y, np.maximum(x, y), x * x + y * y
    cell = np.zeros((side_px, side_px), dtype=np.int64)
    cell[diamond < 0.98] = 1
    cell[diamond < 0.90] = 2
    cell[(diamond < 0.66) | ((square < 0.47) & (diamond < 0.90))] = 0
    cell[disc < 0.40**2] = 3
    cell[disc < 0.34**2] = 1
    cell[disc < 0.13**2] = 2
    cell[(2.0 - diamond) < 0.42] = 3
    return inlay(panels, cell)


def clouds(height: int, width: int, cells: int, octaves: int, seed: int) -> Floats:
    """(height, width) smooth noise in 0..1 that repeats: `cells` bumps across, each octave twice as fine."""
    total = np.zeros((height, width))
    weight, reach = 1.0, 0.0
    for octave in range(octaves):
        count = cells << octave
        bumps = _bumps(height, width, count, count, seed * 31 + octave)
        bumps *= weight
        total += bumps
        reach += weight
        weight *= 0.5
    total /= reach
    return total


def _stretched_clouds(side_px: int, seed: int) -> Floats:
    """Noise drawn out along x: fibres."""
    return 0.6 * _bumps(side_px, side_px, 128, 4, seed) + 0.4 * _bumps(side_px, side_px, 256, 8, seed + 1)


def _bumps(height: int, width: int, rows: int, columns: int, seed: int) -> Floats:
    """Random values at the corners of a repeating lattice, smoothly in between."""
    corners = stream(rows * columns, seed).reshape(rows, columns)
    top, bottom, fall = _between(height, rows)
    left, right, run = _between(width, columns)
    lines = corners[:, left] + (corners[:, right] - corners[:, left]) * run
    bumps = lines[bottom]
    above = lines[top]
    bumps -= above
    bumps *= fall[:, None]
    bumps += above
    return bumps


def _between(pixels: int, cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """For each pixel centre the lattice lines on both sides, and the smooth share of the second."""
    place = (np.arange(pixels) + 0.5) * cells / pixels
    low = place.astype(np.int64)
    t = place - low
    return low % cells, (low + 1) % cells, t * t * (3.0 - 2.0 * t)


def stream(count: int, seed: int) -> Floats:
    """(count,) float64 in [0, 1) from the raw bits of PCG64, which NumPy promises never to change."""
    bits = np.random.PCG64(seed).random_raw(count)
    return (bits >> np.uint64(11)).astype(np.float64) * 2.0**-53


def _vein(field: Floats, width: float) -> Floats:
    """1 where the field crosses its middle, falling to 0 about `width` away."""
    away = (field - 0.5) / width
    return 1.0 / (1.0 + away * away)


def _wave(phase: Floats) -> Floats:
    """A smooth wave in 0..1 with period 1."""
    t = np.abs(2.0 * (phase - np.floor(phase)) - 1.0)
    return t * t * (3.0 - 2.0 * t)


def _mix(first: ArrayLike, second: ArrayLike, share: Floats) -> Pixels:
    start = np.asarray(first, dtype=np.float64)
    colour: Floats = (np.asarray(second, dtype=np.float64) - start) * share[:, :, None]
    colour += start
    return _bytes(colour)


def _bytes(colour: Floats) -> Pixels:
    """Rounded to the nearest byte, clipped."""
    rounded = colour + 0.5
    return np.clip(rounded, 0.0, 255.0, out=rounded).astype(np.uint8)
