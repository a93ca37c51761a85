"""Asking by error: as few samples as meet it, the best there is where none does, and the same bytes always."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.errors import SettingsError
from renderer.frame import FrameRequest, RayCounts
from renderer.gaze import Gaze
from renderer.growth import Growth
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.refinement import Refined, foreseen, refine
from renderer.standard_error import StatedError
from tests.renderer.drawing import glass_and_mirror

CELLS = 10


def refined(
    most: int, max_error: float | None, spread: float, time_for: int | None = None
) -> tuple[Refined, list[int]]:
    """Cells of independent samples with this standard deviation, and the numbers of samples that were tried."""
    tried: list[int] = []

    def grow_to(samples: int) -> Growth:
        new = CELLS * (samples - (tried[-1] if tried else 0))
        tried.append(samples)
        return Growth(CELLS, new, new, RayCounts(new), 0, CELLS * samples, samples, 1)

    def judge() -> StatedError:
        return StatedError(spread / math.sqrt(tried[-1]), spread / 2, 1.0 if tried[-1] == 1 else 0.0)

    found = refine(grow_to, judge, lambda _: time_for or 0, most, max_error, hurried=time_for is not None)
    return found, tried


@given(st.integers(1, 300), st.floats(0.01, 2.0), st.none() | st.integers(1, 300))
def test_no_more_samples_than_the_error_calls_for(most: int, max_error: float, time_for: int | None) -> None:
    spread = 0.1
    found, tried = refined(most, max_error, spread, time_for)
    allowed = most if time_for is None else min(most, time_for)
    enough = max(2, math.ceil(max(0.0, (spread / max_error) ** 2 - 1e-9)))
    assert tried == sorted(set(tried))
    assert found.wanted == tried[-1] == found.growth.fewest
    assert found.growth.samples == CELLS * found.wanted == found.growth.rays.primary
    assert found.growth.cells == CELLS
    if max_error < spread / 2:
        assert found.wanted == max(1, allowed)
    else:
        assert found.wanted <= max(enough + max(0, enough // 16), 1)
        assert found.wanted >= min(enough, max(1, allowed))
        assert found.error.within(max_error) == (found.wanted >= enough)


def test_what_has_no_bound_is_traced_at_once() -> None:
    found, tried = refined(64, None, 0.1)
    assert (found.wanted, tried) == (64, [64])
    assert refined(64, None, 0.1, time_for=7)[1] == [1, 7]


def test_a_guess_is_no_reason_to_stop_nor_to_leap() -> None:
    guess = StatedError(0.1, 0.1, 0.01)
    assert not guess.within(1.0)
    assert foreseen(guess, 1, 1e-3) == 2
    assert StatedError(0.1, None, 0.0).within(0.1)
    assert not StatedError(0.1, 0.2, 0.0).within(0.15)
    assert foreseen(StatedError(0.1, None, 0.0), 4, 1e-300) > 4


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(max_error: float | None, gaze_x: float = 20.0, **changes: object) -> FrameRequest:
    quality = Quality(samples_per_cell=24, acuity=Acuity(scale=8.0), max_error=max_error)
    quality = dataclasses.replace(quality, **changes)  # type: ignore[arg-type]
    return FrameRequest(Gaze(gaze_x, 15), Display(64, 36, width_cm=6.0), None, quality, linear=True)


@pytest.mark.parametrize("antialiasing", ["stochastic", "regular", "adaptive"])
def test_a_frame_by_its_error_is_the_same_on_any_threads_and_after_any_others(
    scene: PreparedScene, antialiasing: str
) -> None:
    one, three = Renderer(threads=1), Renderer(threads=3)
    all_samples = one.render(scene, asked(None, antialiasing=antialiasing)).cost
    bound = 1.7 * max(all_samples.rms_error, all_samples.foveal_rms_error or 0.0)
    wish = asked(bound, antialiasing=antialiasing)
    three.render(scene, asked(None, 40.0, antialiasing=antialiasing))
    three.render(scene, asked(bound / 2, antialiasing=antialiasing))
    first, again, other = one.render(scene, wish), one.render(scene, wish), three.render(scene, wish)
    assert first.cost.error_met
    assert 2 <= first.cost.samples_per_cell < 24
    for frame in (again, other):
        np.testing.assert_array_equal(frame.pixels, first.pixels)
        assert frame.cost.rms_error == first.cost.rms_error
        assert frame.cost.samples_per_cell == first.cost.samples_per_cell
    fewer = dataclasses.replace(asked(None, antialiasing=antialiasing), samples=first.cost.samples_per_cell - 1)
    fresh = Renderer(threads=2)
    short = fresh.render(scene, fewer).cost
    assert max(short.rms_error, short.foveal_rms_error or 0.0) > bound or short.guessed_error > 0
    same = fresh.render(scene, dataclasses.replace(fewer, samples=first.cost.samples_per_cell))
    np.testing.assert_array_equal(same.pixels, first.pixels)
    for renderer in (one, three, fresh):
        renderer.close()


def test_an_impossible_error_gives_the_best_frame_and_says_so(scene: PreparedScene) -> None:
    made = Renderer(threads=2)
    best = made.render(scene, asked(None))
    for wish in (asked(1e-9), asked(1e-9, deadline_ms=600_000.0)):
        frame = made.render(scene, wish)
        assert (frame.cost.error_met, frame.cost.max_error, frame.cost.samples_per_cell) == (False, 1e-9, 24)
        np.testing.assert_array_equal(frame.pixels, best.pixels)
    in_no_time = made.render(scene, asked(1e-9, 50.0, deadline_ms=1e-6)).cost
    assert (in_no_time.deadline_met, in_no_time.error_met, in_no_time.samples_per_cell) == (False, False, 1)
    made.close()


def test_with_time_enough_an_error_is_met_as_without_a_deadline(scene: PreparedScene) -> None:
    made, fresh = Renderer(threads=2), Renderer(threads=2)
    plain = made.render(scene, asked(0.05))
    timed = fresh.render(scene, asked(0.05, deadline_ms=600_000.0))
    assert plain.cost.error_met
    assert timed.cost.error_met
    assert timed.cost.deadline_met
    np.testing.assert_array_equal(timed.pixels, plain.pixels)
    made.close()
    fresh.close()


@pytest.mark.parametrize("max_error", [0, -1, 1e7, float("nan"), "5", True])
def test_errors_out_of_range_are_refused(max_error: float) -> None:
    with pytest.raises(
        SettingsError, match=r"quality\.max_error: expected a number in \(0, 1e\+06\]|quality\.max_error"
    ):
        Quality(max_error=max_error)
