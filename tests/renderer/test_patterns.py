"""Procedural textures: the same bytes everywhere, seamless where they tile."""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np
import pytest

from renderer.scenes import patterns

STONES = tuple(patterns.marble((40 * i, 200, 90), (10, 20, 30 * i), i, side_px=64) for i in range(4))

TILES: dict[str, Callable[[], patterns.Pixels]] = {
    "plaster": lambda: patterns.plaster((200, 180, 150), 1, side_px=128),
    "marble": lambda: patterns.marble((230, 220, 200), (90, 80, 70), 2, side_px=128),
    "starry": lambda: patterns.starry((20, 40, 90), (240, 210, 120), 4, 3, side_px=128),
    "parquet": lambda: patterns.parquet(STONES),
    "wood": lambda: patterns.wood((180, 130, 80), (90, 50, 30), 4, side_px=128),
    "masonry": lambda: patterns.masonry([(200, 180, 150), (180, 160, 120)], (90, 80, 70), 4, 2, 5, side_px=128),
}
PAINTINGS: dict[str, Callable[[], patterns.Pixels]] = {
    "landscape": lambda: patterns.landscape(6, 96, 64),
    "composition": lambda: patterns.composition(7, 96, 96),
    "checkerboard": lambda: patterns.checkerboard((255, 255, 0), (255, 0, 0), 64),
}


@pytest.mark.parametrize("name", [*TILES, *PAINTINGS])
def test_patterns_are_rgb_bytes_and_repeat_exactly(name: str) -> None:
    make = {**TILES, **PAINTINGS}[name]
    pixels = make()
    assert pixels.dtype == np.uint8
    assert pixels.ndim == 3
    assert pixels.shape[2] == 3
    assert len(np.unique(pixels)) > 1
    np.testing.assert_array_equal(pixels, make())


@pytest.mark.parametrize("name", ["plaster", "marble", "starry"])
def test_a_tile_joins_itself_as_smoothly_as_it_runs_inside(name: str) -> None:
    pixels = TILES[name]().astype(np.int64)
    for axis in (0, 1):
        inside = np.abs(np.diff(pixels, axis=axis)).max()
        across = np.abs(np.take(pixels, 0, axis) - np.take(pixels, -1, axis)).max()
        assert across <= inside


def test_the_random_stream_is_the_one_it_has_always_been() -> None:
    np.testing.assert_array_equal(patterns.stream(3, 1), [0.5118216247002567, 0.9504636963259353, 0.14415961271963373])


def test_the_patterns_are_the_same_bytes_on_every_platform() -> None:
    together = hashlib.sha256()
    for make in (*TILES.values(), *PAINTINGS.values()):
        together.update(make().tobytes())
    assert together.hexdigest() == "ae22f42c0751b6c97192f88cd9c0bc8c45062d5e89c4043f5c78557830399c75"


def test_clouds_stay_within_nought_and_one_and_fill_the_middle() -> None:
    field = patterns.clouds(96, 160, 4, 5, 9)
    assert field.shape == (96, 160)
    assert field.min() >= 0.0
    assert field.max() <= 1.0
    assert 0.4 < float(field.mean()) < 0.6
    assert float(field.std()) > 0.05


def test_a_checkerboard_is_light_at_its_bottom_left_and_has_sharp_edges() -> None:
    pixels = patterns.checkerboard((255, 255, 0), (200, 0, 0), 8)
    light, dark = [255, 255, 0], [200, 0, 0]
    assert [pixels[7, 0].tolist(), pixels[0, 0].tolist()] == [light, dark]
    assert [pixels[4, 3].tolist(), pixels[4, 4].tolist(), pixels[3, 4].tolist()] == [light, dark, light]


def test_masonry_shows_its_joints_and_shifts_every_second_course() -> None:
    pixels = patterns.masonry([(200, 180, 150)], (1, 2, 3), 4, 2, 5, side_px=64, joint_px=2)
    joints = (pixels == (1, 2, 3)).all(axis=2)
    assert joints[::16].all()
    assert not joints[8].all()
    upright = [np.flatnonzero(joints[row]).tolist() for row in (8, 24)]
    assert upright == [[0, 1, 32, 33], [16, 17, 48, 49]]


def test_inlay_takes_each_pixel_from_its_panel() -> None:
    panels = [np.full((2, 2, 3), 10 * i, dtype=np.uint8) for i in range(3)]
    mosaic = patterns.inlay(panels, np.array([[0, 1], [2, 1]]))
    assert mosaic[:, :, 0].tolist() == [[0, 10], [20, 10]]
    assert panels[0].max() == 0
