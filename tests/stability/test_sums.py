"""Samples, sums and threads: convergence, many rays, the same bits on any number of threads, divisions."""

from __future__ import annotations

import dataclasses
import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from renderer import whitted
from renderer.acuity import Acuity
from renderer.camera import Camera, view_frame
from renderer.display import Display
from renderer.frame import FrameRequest, RayCounts
from renderer.fresnel import fresnel, refracted_cosine
from renderer.gaze import Gaze
from renderer.kernel import kernel
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import MAPS, Quality
from renderer.rays import make_rays, rows_of
from renderer.sampling import camera_rays, lattice_order
from renderer.scene import Mesh, Scene, Sphere
from renderer.sphere import hit_distance
from renderer.surface import weights_at
from renderer.texture import wrap
from renderer.tracing import block_starts, total_rays
from renderer.whitted import samples_between
from tests.renderer.cell_point import places
from tests.renderer.drawing import (
    EVERYWHERE_1,
    glass,
    glass_and_mirror,
    lamp,
    quad,
    shoot,
)


def test_h51_the_error_of_an_edge_falls_with_the_root_of_the_samples() -> None:
    """An edge covers 0.3 of each of 1,024 cells; n from 4 to 1,024. The slope's own standard error is 0.006."""
    covered = places([(x, y, 1) for y in range(32) for x in range(32)], 1024)[..., 0] % 1.0 < 0.3
    counts = np.array([4, 16, 64, 256, 1024])
    errors = [math.sqrt(((covered[:, :n].mean(axis=1) - 0.3) ** 2).mean()) for n in counts]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(-0.5, abs=0.05)


def test_h51_an_edge_through_pixels_has_the_right_mean(renderer: Renderer) -> None:
    """2,048 pixels of which 0.3 is bright, 256 samples each: each pixel within the bound that all of them exceed by
    chance in one run of 100 (Sidak: a level of 1 - 0.99^(1/2048) each, 4.9e-6), and their mean, which would show a
    bias that no pixel shows, within 4 standard errors (one run in 16,000).
    """
    pixels, samples, share = 2048, 256, 0.3
    camera = Camera((0, 0, 1), (0, 0, 0), vertical_fov_deg=90)
    width = 2.0 / pixels
    scene = Scene(meshes=(quad((-1, -1, 0), (1 - width / 2 + share * width, 0, 0), (0, 2, 0), lamp()),), camera=camera)
    seen = shoot(renderer, scene, 1, pixels, samples=samples).pixels[..., 0].ravel()
    variance = share * (1 - share)
    z = (seen - share) * math.sqrt(samples / variance)
    level = 1 - 0.99 ** (1 / pixels)
    assert np.abs(z).max() < NormalDist().inv_cdf(1 - level / 2)
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


@pytest.mark.parametrize("tiling", MAPS)
@pytest.mark.parametrize("antialiasing", ["stochastic", "regular"])
def test_h53_threads_change_no_byte(tiling: str, antialiasing: str) -> None:
    quality = Quality(map=tiling, antialiasing=antialiasing, acuity=Acuity(scale=16.0), samples_per_cell=3)
    asked = FrameRequest(Gaze(30, 20), Display(96, 64, width_cm=8.0), None, quality)
    scene = prepare(glass_and_mirror())
    pictures = []
    for threads in (1, 2, 3, 8):
        fresh = Renderer(threads=threads)
        for linear in (True, False):
            pictures.append(fresh.render(scene, dataclasses.replace(asked, linear=linear)).pixels)
        fresh.close()
    for linear, picture in zip([True, False] * 4, pictures, strict=True):
        np.testing.assert_array_equal(picture, pictures[0 if linear else 1])


@pytest.mark.parametrize("radius_px", [5.0, 17.3, 28.0])
def test_h51_a_disc_covers_its_area(renderer: Renderer, radius_px: float) -> None:
    """A glowing sphere in the middle of 64 x 64 pixels: covered parts of pixels add up to pi r^2. 64 samples; the
    border's pixels, no more than 8 r, each have a variance of at most 1/4 of a sample's: 4 standard errors of that.
    """
    pixels, samples = 64, 64
    half = math.tan(math.radians(10))
    slope = radius_px / (pixels / 2) * half
    sphere = Sphere((0, 0, 0), 6 * math.sin(math.atan(slope)), lamp())
    camera = Camera((0, 0, 6), (0, 0, 0), vertical_fov_deg=20)
    seen = shoot(renderer, Scene(spheres=(sphere,), camera=camera), pixels, pixels, samples=samples).pixels
    error = math.sqrt(8 * radius_px / (4 * samples))
    assert float(seen[..., 0].sum()) == pytest.approx(math.pi * radius_px**2, abs=4 * error)


def test_h52_blocks_of_more_than_2_to_the_31_samples() -> None:
    """30,000 cells of 100,000 samples: sums are 64 bits wide, and every cell is in one block of at most a million."""
    first = np.zeros(30_000, dtype=np.int32)
    until = np.full_like(first, 100_000)
    assert block_starts(first, until, 1_000_000) == list(range(0, 30_001, 10))
    assert samples_between(first, until) == 3_000_000_000
    counted = total_rays([RayCounts(primary=2**31 - 1, shadow=5)] * 3)
    assert counted.primary == 3 * (2**31 - 1)
    assert counted.total == 3 * (2**31 + 4)


@pytest.mark.parametrize(("width", "height"), [(15_360, 8640), (16_384, 8640)])
def test_h52_the_last_pixels_of_a_huge_screen(width: int, height: int) -> None:
    """Index arithmetic alone: rays of cells at the far end, to 2^-10 of a pixel (h61: pixel and fraction are kept
    apart until float64 directions are made of them). Float32 directions resolve 2^-11 of a pixel here.
    """
    display = Display(width, height)
    view = view_frame(Camera((0, 0, 0), (0, 0, -1)), display)
    x = np.array([width - 1, width - 2, 0], dtype=np.int32)
    y = np.array([height - 1, 0, height - 1], dtype=np.int32)
    side, chosen = np.ones(3, dtype=np.int32), np.arange(3, dtype=np.int32)
    rays = make_rays(3)
    first = np.zeros(3, dtype=np.int32)
    camera_rays(
        view, np.zeros(3, np.float32), width, height, x, y, side, chosen,
        first, first + 1, 1, 0, lattice_order(1), rays,
    )  # fmt: skip
    direction = rows_of(rays.direction).astype(np.float64)
    along = view.corner + (x + 0.5)[:, None] * view.step_x + (y + 0.5)[:, None] * view.step_y
    apart = np.linalg.norm(direction * np.linalg.norm(along, axis=1, keepdims=True) - along, axis=1)
    assert (apart / np.linalg.norm(view.step_x) < 2.0**-10).all()


def test_h53_a_sample_of_more_rays_than_a_block_is_the_same_in_any_company(monkeypatch: pytest.MonkeyPatch) -> None:
    """Such a sample is cut where its rays fill a block, and adds up in the order of its parts: other cells, threads
    and tilings change no bit of it. Another size of block would, by rounding; the size follows from the request.
    """
    monkeypatch.setattr(whitted, "BLOCK_RAYS", 64)
    balls = tuple(Sphere((0.03 * i, 0.02 * i, 0), 1.0 - i / 8, glass(1.5 if i % 2 == 0 else 0.8)) for i in range(5))
    scene = prepare(
        Scene(spheres=balls, surroundings=EVERYWHERE_1, exposure=1e6, camera=Camera((0, 0.3, 6), (0, 0, 0)))
    )
    pictures = []
    for threads in (1, 2, 3):
        fresh = Renderer(threads=threads)
        pictures.append(shoot(fresh, scene, 6, 4, depth=12).pixels)
        part = shoot(fresh, scene, 6, 4, depth=12, tiling="aligned").pixels
        np.testing.assert_array_equal(part, pictures[0])
        fresh.close()
    for picture in pictures[1:]:
        np.testing.assert_array_equal(picture, pictures[0])


def test_h54_formulas_meet_what_divides_by_zero() -> None:
    """Each where it could: no exception, and an answer that means "nothing"."""
    nan, inf = math.nan, math.inf
    assert hit_distance(0, 0, 0, 0.0, 0.0, 0.0, 5, 0, 0, 1.0) == inf
    assert hit_distance(0, 0, 0, nan, 0.0, 0.0, 5, 0, 0, 1.0) == inf
    flat: Any = np.zeros((1, 32), dtype=np.float32)
    assert weights_at(flat, 0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0) == (0.0, 0.0)
    assert refracted_cosine(1.0000001, 1.5) == 1.0
    assert refracted_cosine(nan, 1.5) <= 1.0
    assert fresnel(0.0, refracted_cosine(0.0, 1 / 1.5), 1 / 1.5) == 1.0
    assert fresnel(0.0, 0.0, 1.0) == 1.0
    assert [wrap(value) for value in (nan, inf, -inf)] == [0.0, 0.0, 0.0]
