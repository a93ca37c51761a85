"""Adaptive antialiasing: as accurate as stochastic with fewer samples, hardly biased, and history changes no byte."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.adaptive import UNSEEN_CODES
from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, Quality
from renderer.scene import Mesh, Scene, Surroundings
from renderer.scenes import BUILT_IN
from renderer.store import FIRST_ROUND, LUMINANCE
from renderer.texture import srgb_to_linear
from renderer.tonemap import encode_srgb
from tests.renderer.drawing import glass_and_mirror, lamp, quad, shoot

SCREEN = Display(64, 36, width_cm=6.0)
MOST = 32
CODE_AT_MID_GREY = 0.0039
"""Linear light of one 8-bit code at 0.2."""


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(
    gaze: tuple[float, float] = (30, 20),
    samples: int | None = None,
    tiling: str = "aligned",
    antialiasing: str = "adaptive",
    most: int = MOST,
    display: Display = SCREEN,
    scale: float = 16.0,
) -> FrameRequest:
    quality = Quality(
        map=tiling, samples_per_cell=most, antialiasing=antialiasing, acuity=Acuity(scale=scale), max_depth=3
    )
    return FrameRequest(Gaze(*gaze), display, None, quality, linear=True, samples=samples)


def fresh(scene: PreparedScene, request: FrameRequest, threads: int = 1) -> Frame:
    renderer = Renderer(threads=threads)
    frame = renderer.render(scene, request)
    renderer.close()
    return frame


def same_picture(one: Frame, other: Frame) -> None:
    np.testing.assert_array_equal(one.pixels, other.pixels)
    assert one.cost.rms_error == other.cost.rms_error
    assert one.cost.foveal_rms_error == other.cost.foveal_rms_error
    assert one.cost.mean_samples == other.cost.mean_samples


@pytest.mark.parametrize("tiling", MAPS)
@pytest.mark.parametrize("most", [2, 4, 7, 32])
def test_threads_and_growth_change_no_byte(scene: PreparedScene, tiling: str, most: int) -> None:
    truth = fresh(scene, asked(tiling=tiling, most=most))
    assert min(most, FIRST_ROUND) <= truth.cost.mean_samples <= most
    for threads, path in ((3, ()), (2, (1, 2, 5)), (1, (6, 9)), (2, (4, 8, 16, 31))):
        growing = Renderer(threads=threads)
        for samples in path:
            if samples <= most:
                growing.render(scene, asked(samples=samples, tiling=tiling, most=most))
        same_picture(growing.render(scene, asked(tiling=tiling, most=most)), truth)
        again = growing.render(scene, asked(tiling=tiling, most=most))
        same_picture(again, truth)
        assert again.cost.samples_traced == again.cost.cells_traced == 0
        growing.close()


@settings(max_examples=15)
@given(
    path=st.lists(
        st.tuples(
            st.floats(-10, 70),
            st.floats(-10, 45),
            st.none() | st.integers(1, MOST),
            st.sampled_from(["aligned", "full"]),
            st.sampled_from([8.0, 16.0, 40.0]),
        ),
        max_size=5,
    )
)
def test_whatever_was_traced_before_changes_no_byte(
    scene: PreparedScene, path: list[tuple[float, float, int | None, str, float]]
) -> None:
    growing = Renderer(threads=2)
    for x, y, samples, tiling, scale in path:
        growing.render(scene, asked((x, y), samples, tiling, scale=scale))
    same_picture(growing.render(scene, asked()), fresh(scene, asked()))
    growing.close()


def test_costs_add_up(scene: PreparedScene) -> None:
    """Squares beside the cells are sampled to decide about them: few, and counted."""
    cost = fresh(scene, asked()).cost
    assert cost.samples_per_cell == MOST
    assert cost.cells_traced == cost.cells
    assert cost.rays.primary == cost.samples_traced
    shown = cost.mean_samples * cost.cells
    assert shown <= cost.samples_traced < 1.5 * shown
    assert cost.rms_error > 0


def test_where_nothing_differs_the_first_round_is_enough(renderer: Renderer) -> None:
    """Also on a slope of light that is too gentle for its cells to differ by more than a code or two."""
    for zenith in (1.0, 0.5):
        plain = Scene(surroundings=Surroundings(horizon=(0.6,) * 3, zenith=(0.6 * zenith,) * 3))
        cost = shoot(renderer, plain, 64, 48, samples=64, antialiasing="adaptive").cost
        assert cost.mean_samples == FIRST_ROUND
        assert cost.samples_per_cell == 64


def test_the_flat_parts_of_matte_stop_early_and_its_edges_do_not() -> None:
    prepared = prepare(BUILT_IN["matte"]())
    renderer = Renderer(threads=2)
    display = Display(192, 108, width_cm=20)
    renderer.render(prepared, asked((48, 27), tiling="full", display=display))
    number = next(store for store, _ in renderer.store_cache._values.values()).samples.number[: display.pixels]
    shares = np.bincount(number) / display.pixels
    assert set(np.flatnonzero(shares)) <= {4, 8, 16, 32}
    assert shares[4] > 0.4
    assert shares[32] < 0.45
    renderer.close()


def test_adaptive_samples_leave_less_error_on_spheres_than_as_many_spread_evenly() -> None:
    """At 96x54: 16.6 of at most 32 samples leave 1.06 times the error of all 32, and 0.76 of that of 16 everywhere."""
    prepared = prepare(BUILT_IN["spheres"]())
    renderer = Renderer(threads=2)
    display, exposure = Display(96, 54, width_cm=10), prepared.scene.exposure

    def render(antialiasing: str, most: int) -> Frame:
        return renderer.render(prepared, asked((40, 30), None, "aligned", antialiasing, most, display, 4.0))

    truth, adaptive, stochastic = render("stochastic", 1024), render("adaptive", MOST), render("stochastic", MOST)
    half = render("stochastic", MOST // 2)
    error = {
        frame: math.sqrt(float(((clipped(frame, exposure) - clipped(truth, exposure)) ** 2).mean()))
        for frame in (adaptive, stochastic, half)
    }
    assert adaptive.cost.samples_traced < 0.55 * stochastic.cost.samples_traced
    assert error[adaptive] < 1.15 * error[stochastic]
    assert error[adaptive] < 0.85 * error[half]
    renderer.close()


def clipped(frame: Frame, exposure: float) -> NDArray[np.float32]:
    return np.clip(frame.pixels * np.float32(exposure), 0.0, 1.0)


@pytest.mark.parametrize("name", ["spheres", "cornell", "matte"])
def test_the_mean_picture_is_that_of_stochastic_samples(name: str) -> None:
    """Over the 5,184 pixels of a screen, what is shown, at the same most samples: within 4 standard errors and a
    tenth of an 8-bit code at mid-grey, which is what stopping early may cost.
    """
    prepared = prepare(BUILT_IN[name]())
    renderer = Renderer(threads=2)
    display = Display(96, 54, width_cm=10)
    adaptive, stochastic = (
        renderer.render(prepared, asked((40, 30), None, "full", kind, 16, display))
        for kind in ("adaptive", "stochastic")
    )
    assert adaptive.cost.samples_traced < 0.8 * stochastic.cost.samples_traced
    exposure = prepared.scene.exposure
    difference = (clipped(adaptive, exposure) - clipped(stochastic, exposure)) @ np.array(LUMINANCE)
    assert difference.std() > 0
    assert abs(difference.mean()) < 4 * difference.std() / math.sqrt(display.pixels) + 0.1 * CODE_AT_MID_GREY
    renderer.close()


ACROSS, DOWN = 96, 64


def lines(share: float, bright: float, dark: float) -> PreparedScene:
    """A line in each pixel, `share` of it wide, anywhere in it."""
    rng = np.random.default_rng(int(1000 * share))
    corners = []
    for row in range(DOWN):
        for column in range(ACROSS):
            left = column + rng.uniform(0, 1 - share)
            corners.append((2 * left / DOWN - ACROSS / DOWN, 2 * row / DOWN - 1, 0.0))
    width = 2 * share / DOWN
    square = quad((0, 0, 0), (width, 0, 0), (0, 2 / DOWN, 0), lamp(bright))
    vertices = np.concatenate([square.vertices + corner for corner in corners])
    faces = np.concatenate([square.faces + 4 * index for index in range(len(corners))])
    back = quad((-2, -2, -0.001), (4, 0, 0), (0, 4, 0), lamp(dark))
    camera = Camera((0, 0, 10), (0, 0, 0), vertical_fov_deg=2 * math.degrees(math.atan(1 / 10)))
    return prepare(Scene(meshes=(back, Mesh(vertices, faces, square.material)), camera=camera))


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
@pytest.mark.parametrize(("bright", "dark"), [(0.8, 0.2), (0.2, 0.8), (0.9, 0.0)])
def test_what_stopping_early_overlooks_stays_below_what_can_be_seen(
    renderer: Renderer, share: float, bright: float, dark: float
) -> None:
    """6,144 pixels with a line each, on average against their light by area: the worst case of the bound that
    `renderer.adaptive` states, with 4 standard errors of the mean.
    """
    display = Display(ACROSS, DOWN, 3.0 * ACROSS / DOWN, 3.0)
    frame = renderer.render(lines(share, bright, dark), asked((0, 0), None, "full", display=display))
    true = dark + share * (bright - dark)
    code_light = float(np.gradient(srgb_to_linear(np.arange(256) / 255))[int(encode_srgb(np.array([true]))[0])])
    overlooked = share * (1 - share) ** 36 * abs(bright - dark)
    noise = abs(bright - dark) * math.sqrt(share * (1 - share) / FIRST_ROUND / frame.cost.cells)
    assert abs(frame.pixels[..., 0].mean() - true) < overlooked + UNSEEN_CODES / math.e * code_light + 4 * noise
    assert frame.cost.mean_samples > FIRST_ROUND
