"""The same light as Mitsuba 3 finds: its shapes, materials, lights and camera, and its own integrators.

Where its integrators compute another model, a scene is chosen in which both coincide: `direct` knows no mirrors,
`path` follows light between matt surfaces too, and is given things that glow in place of lit ones. For mirrors and
glass before matt things its parts are called ray by ray, in Whitted's order, which is free of noise. What differs:

- Rays start again farther from a surface, by 8.9e-5 of (1 + the largest coordinate) in place of some 1e-6: what is
  seen in curved mirrors and through balls is shifted by that, magnified, and edges seen there fall a pixel later.
- Mitsuba scales radiance by n^2 inside glass; carried as importance, light is not scaled, as in Whitted's model.
- Glass blocks light on its way to a lamp in both.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clients.command_line.peers.mitsuba_scene import has_mitsuba, mitsuba_scene
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Scene
from tests.agreement.comparison import assert_consistent, assert_equal_light, require
from tests.agreement.mitsuba_peer import followed_picture, repeated_pictures
from tests.agreement.scenes import (
    bubble,
    glass_scene,
    glowing_glass_scene,
    lamp_scene,
    matt_scene,
    mirror_scene,
    textured_scene,
)
from tests.renderer.drawing import shoot

SCREEN = Display(96, 64)
SMALL_SCREEN = Display(64, 48)

REPEATS = 32
SAMPLES = 16
"""A pixel in each of as many independent pictures, whose spread is the noise of their mean."""

OUR_SAMPLES = 256
"""A pixel, on a lattice, towards each light with a size as many shadow rays: a few times less noise than theirs."""

CONSISTENT = 0.9975
"""Share of the pixels that pass; about as many fail by chance as the spread of 32 pictures is itself uncertain."""


@pytest.fixture(autouse=True)
def _mitsuba() -> None:
    require(has_mitsuba(), "Mitsuba (the extra 'peers')")


def averaged(renderer: Renderer, scene: Scene, depth: int) -> NDArray[np.float64]:
    """Our picture, each pixel the mean over its area."""
    quality = Quality(
        map="full", samples_per_cell=OUR_SAMPLES, antialiasing="regular", max_depth=depth, shadow_samples=OUR_SAMPLES
    )
    middle = Gaze(SMALL_SCREEN.width_px / 2, SMALL_SCREEN.height_px / 2)
    frame = renderer.render(prepare(scene), FrameRequest(middle, SMALL_SCREEN, None, quality, linear=True))
    return frame.pixels.astype(np.float64)


def assert_averages_agree(
    renderer: Renderer, scene: Scene, integrator: dict[str, Any], depth: int, folder: Path
) -> None:
    theirs, error = repeated_pictures(mitsuba_scene(scene, SMALL_SCREEN), integrator, REPEATS, SAMPLES)
    ours = averaged(renderer, scene, depth)
    assert_consistent(ours, theirs, error, REPEATS * SAMPLES, CONSISTENT, folder)


def followed(renderer: Renderer, scene: Scene, depth: int) -> tuple[NDArray[np.floating], NDArray[np.float64]]:
    """Our picture and theirs, one ray through the middle of each pixel."""
    theirs = followed_picture(mitsuba_scene(scene, SCREEN), scene.surroundings, SCREEN, depth)
    return shoot(renderer, scene, SCREEN.width_px, SCREEN.height_px, depth=depth).pixels, theirs


def test_matt_things_under_point_lights(renderer: Renderer, tmp_path: Path) -> None:
    """Ray by ray: nothing but float32 between them."""
    ours, theirs = followed(renderer, matt_scene(), 0)
    assert_equal_light(ours, theirs, 1e-5, 0.9995, tmp_path)


def test_mirrors_in_mirrors(renderer: Renderer, tmp_path: Path) -> None:
    """Flat, round, coloured and half matt ones, six deep."""
    ours, theirs = followed(renderer, mirror_scene(), 6)
    assert_equal_light(ours, theirs, 1e-4, 0.997, tmp_path)
    assert_equal_light(ours, theirs, 1e-3, 0.999, tmp_path)


def test_glass_before_matt_things(renderer: Renderer, tmp_path: Path) -> None:
    """Balls and a box, and a bubble in a ball: both branches at each boundary, six deep."""
    ours, theirs = followed(renderer, glass_scene(True, bubble()), 6)
    assert_equal_light(ours, theirs, 1e-4, 0.96, tmp_path)
    assert_equal_light(ours, theirs, 1e-3, 0.995, tmp_path)
    assert_equal_light(ours, theirs, 1e-2, 0.999, tmp_path)


def test_textures_and_cut_outs(renderer: Renderer, tmp_path: Path) -> None:
    """Magnified pictures, interpolated in linear light, on and beyond their edges; the shadow of a fence.
    What is seen through its gaps is shifted by where their rays start again.
    """
    ours, theirs = followed(renderer, textured_scene(), 0)
    assert_equal_light(ours, theirs, 1e-4, 0.9995, tmp_path)


def test_averages_of_matt_things(renderer: Renderer, tmp_path: Path) -> None:
    """Its `direct` integrator; edges of things and shadows are means over the pixel."""
    assert_averages_agree(renderer, matt_scene(), {"type": "direct"}, 0, tmp_path)


def test_averages_of_lamps_with_a_size(renderer: Renderer, tmp_path: Path) -> None:
    """Its `direct` integrator: a rectangle and a sphere of light, seen themselves, and their soft shadows."""
    assert_averages_agree(renderer, lamp_scene(), {"type": "direct"}, 0, tmp_path)


def test_averages_of_glass_balls(renderer: Renderer, tmp_path: Path) -> None:
    """Its `path` integrator, which follows one branch of each boundary at random."""
    depth = 8
    integrator = {"type": "path", "max_depth": depth + 1, "rr_depth": 1000}
    assert_averages_agree(renderer, glowing_glass_scene(), integrator, depth, tmp_path)
