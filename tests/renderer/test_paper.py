"""The paper's numbers: what it prints comes out, and what is timed is what was meant to be."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from renderer.acuity import cut_off_cpd
from renderer.cellmap import build_cell_map
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.library import SceneLibrary
from renderer.paper import published
from renderer.paper.rays import CASES, RayCase, count_rays
from renderer.paper.sensitivity import ECCENTRICITIES_DEG, foveal_sensitivity, frequencies_cpd, sensitivity
from renderer.paper.timing import OURS, PAPER, QUALITIES, compare_times
from renderer.pipeline import Renderer
from renderer.workers import WorkerPool

FREQUENCIES = st.floats(0.01, 100)


def test_the_eye_is_most_sensitive_at_four_cycles_per_degree() -> None:
    """The maximum of f^b exp(-c f) is at b/c."""
    frequency = np.linspace(0, 60, 60_001)
    values = foveal_sensitivity(frequency)
    assert frequency[values.argmax()] == pytest.approx(4.0)
    assert values.max() == pytest.approx(75 * (4 / math.e) ** 0.8)
    assert values[0] == 0


@given(frequency=FREQUENCIES, angles=st.tuples(st.floats(0, 60), st.floats(0, 60)), k=st.floats(0.030, 0.057))
def test_sensitivity_falls_off_as_equation_1_says(frequency: float, angles: tuple[float, float], k: float) -> None:
    near, far = sorted(angles)
    assert sensitivity(frequency, 0.0, k) == pytest.approx(foveal_sensitivity(frequency))
    drop = sensitivity(frequency, far, k) / sensitivity(frequency, near, k)
    assert_allclose(drop, math.exp(-k * frequency * (far - near)), rtol=1e-9)


@pytest.mark.parametrize("angle", [angle for angle in ECCENTRICITIES_DEG if angle >= 2.5])
def test_curves_end_at_the_cut_off_of_equation_2(angle: float) -> None:
    frequency = np.geomspace(*frequencies_cpd()[[0, -1]], 100_000)
    seen = frequency[sensitivity(frequency, angle) >= 1]
    assert seen[-1] == pytest.approx(cut_off_cpd(angle), rel=0.06)


def test_the_full_pictures_take_the_rays_that_the_paper_prints() -> None:
    samples = published.SAMPLES_PER_CELL
    assert round(published.SCREEN.pixels * samples / 1e6, 2) == published.FULL_RAYS / 1e6
    assert round(published.LARGE_SCREEN.pixels * samples / 1e6) == published.LARGE_FULL_RAYS / 1e6
    assert round(published.FULL_RAYS / published.REDUCED_RAYS, 2) == published.RAY_RATIO


@pytest.mark.parametrize(("case", "within"), [(CASES[0], 0.02), (CASES[4], 0.01)], ids=["1920x1080", "5400x3900"])
def test_gaze_dependent_pictures_take_the_rays_that_the_paper_prints(
    case: RayCase, within: float, pool: WorkerPool
) -> None:
    count = count_rays(case, pool)
    assert case.published is not None
    assert count.published_ratio is not None
    assert count.rays == count.cells * 32 == pytest.approx(case.published, rel=within)
    assert count.ratio == pytest.approx(count.published_ratio, rel=within)


def test_pictures_are_timed_whole_and_show_the_same_where_cells_are_pixels(
    renderer: Renderer, pool: WorkerPool
) -> None:
    display, gaze, samples, repeats = Display(360, 40, 4.3), Gaze(10.0, 20.0), 2, 2
    ticks: list[None] = []
    times = compare_times(
        renderer, SceneLibrary().load("spheres"), display, gaze, samples, repeats, lambda: ticks.append(None)
    )
    assert len(ticks) == repeats * len(QUALITIES)
    assert [picture.name for picture in times.reduced] == [PAPER, OURS]
    assert times.full.rays.primary == display.pixels * samples
    for picture in (times.full, *times.reduced):
        quality = QUALITIES[picture.name]
        assert len(picture.repeats_ms) == repeats
        assert picture.rays.primary == picture.cells * samples
        assert 0 < picture.map_ms < picture.median_ms
        bucket = bucket_of(gaze, quality.gaze_bucket_px)
        cells = build_cell_map(quality.map, display, quality.acuity, bucket, pool)
        fine = (cells.side == 1)[cells.mask]
        assert fine.any()
        assert fine.all() == (picture is times.full)
        assert_array_equal(picture.pixels[fine], times.full.pixels[fine])


def test_ratios_are_of_the_full_picture_over_the_other(renderer: Renderer) -> None:
    times = compare_times(renderer, SceneLibrary().load("matte"), Display(64, 36, 0.1), Gaze(0.0, 0.0), 1, 3)
    for picture in times.reduced:
        assert picture.cells < times.full.cells
        assert times.camera_ray_ratio(picture) == times.full.cells / picture.cells
        assert times.time_ratios(picture) == tuple(
            times.full.repeats_ms[index] / picture.repeats_ms[index] for index in range(3)
        )
    assert times.ray_ratio(times.full) == 1


def test_curves_are_evenly_spaced_in_logarithm() -> None:
    steps = {round(after / before, 9) for before, after in pairwise(frequencies_cpd())}
    assert len(steps) == 1
