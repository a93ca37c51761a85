"""Samples, sums and threads: convergence, many rays, the same bits on any number of threads, divisions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.kernel import kernel
from renderer.pipeline import Renderer
from renderer.scene import Mesh, Scene
from tests.renderer.cell_point import places
from tests.renderer.drawing import (
    lamp,
    quad,
    shoot,
)


def test_h51_the_error_of_an_edge_falls_with_the_root_of_the_samples() -> None:
    """An edge covers 0.3 of each of 4,096 cells; n from 4 to 1,024."""
    covered = places([(x, y, 1) for y in range(64) for x in range(64)], 1024)[..., 0] % 1.0 < 0.3
    counts = np.array([4, 16, 64, 256, 1024])
    errors = [math.sqrt(((covered[:, :n].mean(axis=1) - 0.3) ** 2).mean()) for n in counts]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(-0.5, abs=0.05)


def test_h51_an_edge_through_pixels_has_the_right_mean(renderer: Renderer) -> None:
    """2,048 pixels of which 0.3 is bright: each within 5.5 and their mean within 4 standard errors."""
    pixels, samples, share = 2048, 256, 0.3
    camera = Camera((0, 0, 1), (0, 0, 0), vertical_fov_deg=90)
    width = 2.0 / pixels
    scene = Scene(meshes=(quad((-1, -1, 0), (1 - width / 2 + share * width, 0, 0), (0, 2, 0), lamp()),), camera=camera)
    seen = shoot(renderer, scene, 1, pixels, samples=samples).pixels[..., 0].ravel()
    variance = share * (1 - share)
    z = (seen - share) * math.sqrt(samples / variance)
    assert np.abs(z).max() < 5.5
    assert abs(z.mean()) * math.sqrt(pixels) < 4.0


def test_h52_a_pixel_at_the_far_end_of_a_huge_screen_is_where_it_should_be(renderer: Renderer) -> None:
    """16,384 pixels wide: a lamp that covers the right half of the last pixel but one."""
    width = 16_384
    camera = Camera((0, 0, 1), (0, 0, 0), vertical_fov_deg=2 * math.degrees(math.atan(1 / width)))
    edge = (width - 1.5) / (width / 2) - 1
    plate = Mesh(
        np.array([[edge, -1, 0], [2, -1, 0], [2, 1, 0], [edge, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]), lamp()
    )
    frame = shoot(renderer, Scene(meshes=(plate,), camera=camera), width, 1, samples=256)
    seen = frame.pixels[0, :, 0]
    assert seen[-1] == 1.0
    assert seen[-2] == pytest.approx(0.5, abs=0.15)
    assert (seen[:-2] == 0).all()


@kernel
def quotient(a: float, b: float) -> float:
    return a / b


@kernel
def is_a_number(x: float) -> bool:
    return x == x


def test_h54_division_by_zero_is_infinite_and_nan_is_seen() -> None:
    assert quotient(1.0, 0.0) == math.inf
    assert quotient(-1.0, 0.0) == -math.inf
    assert math.isnan(quotient(0.0, 0.0))
    assert not is_a_number(math.nan)
