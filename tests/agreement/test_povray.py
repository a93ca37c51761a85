"""The same picture as POV-Ray 3.7 makes, an independent Whitted tracer with Phong's highlights.

Where the models coincide, all that is left is the rounding of its 16-bit picture (half a step, 7.6e-6). What is
kept out of the scenes because the models differ there:

- Things that let light through tint the light behind them in POV-Ray and cast a shadow here: glass casts none.
- Boundaries inside other glass mirror nothing in POV-Ray where a ray leaves them, a ball with a bubble shows
  0.96^3 + 0.04 + 0.04 * 0.96^2 in place of 0.96^4 + 0.04 + 0.04 * 0.96^2: glass is not nested.
- Highlights have one colour, the light's: `specular` is grey.

What remains:

- On smooth triangles: a normal that leans away from the eye, at the silhouette of a mesh, is turned round in
  POV-Ray; and here shadow rays start on the round surface that the triangles stand for, so that the edge of a
  shadow falls elsewhere, by a centimetre on the ball of 320 triangles. Two pixels in 24,576 each.
- In glass: rays start again from points rounded to float32 here and to float64 there. Near the rim of a ball, and
  more so after each bounce inside, a curved boundary magnifies that to some 1e-4, and at edges seen through it a
  pixel or two see another thing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clients.command_line.peers.povray import STEP, find_povray, povray_picture, read_ppm
from renderer.display import Display
from renderer.pipeline import Renderer
from renderer.scene import Scene
from tests.agreement.comparison import assert_equal_light, require
from tests.agreement.scenes import glass_scene, mirror_scene, phong_scene
from tests.renderer.drawing import shoot

SCREEN = Display(192, 128)

ROUNDING = STEP
"""Half a step of its picture, and as much for sums in float32 here and there."""

NEARLY_ALL = 0.9995
"""All but 12 pixels, of edges that fall the other way; 4 do among highlights, at most 2 among mirrors and glass."""


@pytest.fixture(autouse=True)
def _povray() -> None:
    require(find_povray() is not None, "POV-Ray (Debian's package povray)")


def both(
    renderer: Renderer, scene: Scene, depth: int, folder: Path
) -> tuple[NDArray[np.floating], NDArray[np.float64]]:
    """Our picture and theirs, one ray through the middle of each pixel."""
    theirs = povray_picture(scene, SCREEN, depth, folder)
    assert 0.1 < theirs.max() < 1.0  # nothing is clipped
    return shoot(renderer, scene, SCREEN.width_px, SCREEN.height_px, depth=depth).pixels, theirs


def test_diffuse_light_highlights_and_hard_shadows(renderer: Renderer, tmp_path: Path) -> None:
    """Spheres, flat and smooth triangles under two coloured lights, ambient light and a sky."""
    ours, theirs = both(renderer, phong_scene(), 0, tmp_path)
    assert_equal_light(ours, theirs, ROUNDING, NEARLY_ALL, tmp_path)


@pytest.mark.parametrize("depth", [1, 2, 6])
def test_mirrors_in_mirrors(renderer: Renderer, depth: int, tmp_path: Path) -> None:
    """Flat and round ones, cut off after the same number of bounces."""
    ours, theirs = both(renderer, mirror_scene(), depth, tmp_path)
    assert_equal_light(ours, theirs, ROUNDING, 0.999, tmp_path)
    assert_equal_light(ours, theirs, 1e-3, NEARLY_ALL, tmp_path)


@pytest.mark.parametrize("depth", [1, 2, 3, 6])
def test_refraction_fresnel_and_total_reflection(renderer: Renderer, depth: int, tmp_path: Path) -> None:
    """Balls and a box of glass and water: both branches at each boundary, cut off after as many."""
    ours, theirs = both(renderer, glass_scene(casts_shadows=False), depth, tmp_path)
    assert_equal_light(ours, theirs, ROUNDING, 0.995, tmp_path)
    assert_equal_light(ours, theirs, 1e-3, NEARLY_ALL, tmp_path)


def test_pictures_of_16_bits_are_read() -> None:
    content = b"P6\n# Software: a program\n2 1\n65535\n" + bytes([0, 0, 255, 255, 128, 0, 0, 1, 1, 0, 10, 10])
    np.testing.assert_allclose(read_ppm(content) * 65535, [[[0, 65535, 32768], [1, 256, 2570]]], rtol=1e-15)
