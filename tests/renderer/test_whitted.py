"""Whitted's loop: mirrors, glass and depth against closed forms, and scenes that must look the same."""

from __future__ import annotations

import math

import pytest

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.scene import Scene
from tests.renderer.drawing import (
    aim,
    lamp,
    mirror,
    pixel,
    quad,
)

INSIDE = Camera((0, 0, 0), (0.3, 0.2, -1))


# mirrors


@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_depth_counts_what_a_ray_may_meet(renderer: Renderer, depth: int) -> None:
    """A lamp seen in a mirror that is seen in a mirror needs depth 2."""
    periscope = (
        quad((-1, -1, -1), (2, 0, 0), (0, math.sqrt(2), -math.sqrt(2)), mirror()),
        quad((-1, 9, -1 - math.sqrt(2)), (2, 0, 0), (0, math.sqrt(2), math.sqrt(2)), mirror()),
        quad((-1, 8, 5), (2, 0, 0), (0, 4, 0), lamp()),
    )
    middle = -1 + math.sqrt(0.5)
    scene = Scene(meshes=periscope, camera=aim((0, middle, 5), (0, middle, 0)))
    assert pixel(renderer, scene, depth=depth) == (1.0 if depth >= 2 else 0.0)


# glass


# what may be dropped
