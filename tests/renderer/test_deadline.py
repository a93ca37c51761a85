"""What fits into a deadline: the choice as a function of rates, counts and time, and whole frames at both ends."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.acuity import MAX_SCALE, Acuity
from renderer.deadline import LADDER, LATE_SHARE, Work, choose_acuity, choose_samples, ladder, samples_lacking
from renderer.display import Display
from renderer.errors import SettingsError
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pace import Rates
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, Quality
from tests.renderer.drawing import glass_and_mirror

PIXELS = 1000
counts = st.lists(st.integers(0, 500), min_size=2, max_size=12).map(lambda held: np.array(held, dtype=np.float64))
rates = st.builds(Rates, st.floats(0, 50), st.floats(0, 50), st.floats(0.1, 500), st.floats(1, 4))
budgets = st.floats(-1e5, 1e7)


def predicted_ns(rates: Rates, work: Work, wanted: int) -> float:
    """Time for a frame, cell by cell, with the margin."""
    time_ns = rates.frame_pixel * PIXELS + (rates.map_pixel * PIXELS if work.new_map else 0.0)
    for number, cells in enumerate(work.held):
        time_ns += rates.sample * cells * max(0, wanted - number)
    return rates.margin * time_ns


@given(counts, rates, budgets, st.data())
def test_the_most_samples_that_fit_are_chosen(
    held: np.ndarray, speed: Rates, left_ns: float, data: st.DataObject
) -> None:
    most = data.draw(st.integers(1, len(held) - 1))
    chosen = choose_samples(held, most, PIXELS, speed, left_ns)
    work = Work(Acuity(), False, held)
    fitting = [n for n in range(1, most + 1) if predicted_ns(speed, work, n) <= left_ns * (1 + 1e-9)]
    assert chosen == pytest.approx(max(fitting, default=1))


@given(st.lists(st.tuples(st.booleans(), counts), min_size=1, max_size=7), rates, budgets)
def test_the_finest_acuity_that_fits_with_one_sample_is_chosen_or_the_coarsest(
    parts: list[tuple[bool, np.ndarray]], speed: Rates, left_ns: float
) -> None:
    works = [Work(Acuity(scale=scale), *part) for scale, part in zip(LADDER, parts, strict=False)]
    chosen = choose_acuity(iter(works), PIXELS, speed, left_ns)
    fitting = []
    for work in works:
        whole, around = predicted_ns(speed, work, 1), predicted_ns(speed, work, 0)
        if whole <= left_ns or (around > left_ns and whole - around <= LATE_SHARE * around):
            fitting.append(work)
    assert chosen is (fitting[0] if fitting else works[-1])


def test_a_frame_that_is_late_anyway_is_not_made_coarser_than_it_helps() -> None:
    """The map alone takes 5,000 of 3,000 ns: 250 new cells at 10 ns are let be, 251 are not."""
    speed = Rates(5.0, 0.0, 10.0)
    few, many, coarse = (Work(Acuity(), True, np.array([cells, 0.0])) for cells in (250.0, 251.0, 20.0))
    assert choose_acuity([few, coarse], PIXELS, speed, 3000) is few
    assert choose_acuity([many, coarse], PIXELS, speed, 3000) is coarse
    assert choose_acuity([few._replace(new_map=False), coarse], PIXELS, speed, 2499) is coarse


def test_known_choices() -> None:
    """1,000 pixels at 1 ns, 100 cells at 10 ns a sample: a frame of n samples takes 1,000 + 1,000 n ns."""
    speed, held = Rates(5.0, 1.0, 10.0), np.array([100.0, 0, 0, 0, 0, 0, 0, 0, 0])
    assert [choose_samples(held, 8, PIXELS, speed, left) for left in (0, 1999, 2000, 4999, 9000, 1e9)] == [
        1,
        1,
        1,
        3,
        8,
        8,
    ]
    half = np.array([50.0, 0, 0, 0, 50.0, 0, 0, 0, 0])
    assert [choose_samples(half, 8, PIXELS, speed, left) for left in (1500, 3000, 3999, 4000)] == [1, 4, 4, 5]
    everything = np.array([0.0] * 8 + [100.0])
    assert choose_samples(everything, 8, PIXELS, speed, 1000) == 8
    fine, coarse = Work(Acuity(scale=1), False, held), Work(Acuity(scale=2), True, held / 4)
    assert choose_acuity([fine, coarse], PIXELS, speed, 2000) is fine
    assert choose_acuity([fine, coarse], PIXELS, speed, 1999) is coarse
    new = fine._replace(new_map=True)
    assert choose_acuity([new, coarse], PIXELS, speed, 6999) is coarse
    assert choose_acuity([new, coarse], PIXELS, speed, 7000) is new


def test_finer_acuities_than_the_one_that_fits_are_all_that_is_looked_at() -> None:
    looked_at = []

    def works() -> object:
        for scale in LADDER:
            looked_at.append(scale)
            yield Work(Acuity(scale=scale), False, np.array([1000 / scale**2, 0.0]))

    choose_acuity(works(), PIXELS, Rates(0.0, 1.0, 10.0), 4000)  # type: ignore[arg-type]
    assert looked_at == [1.0, 1.5, 2.0]


def test_the_ladder_gets_coarser_and_ends() -> None:
    scales = [acuity.scale for acuity in ladder(Quality(acuity=Acuity(scale=3.0, margin_deg=1.0)))]
    assert scales == [3 * factor for factor in LADDER]
    assert list(LADDER) == sorted(LADDER)
    assert [acuity.scale for acuity in ladder(Quality(acuity=Acuity(scale=MAX_SCALE / 2)))] == [500.0, 750.0, 1000.0]
    assert [acuity.scale for acuity in ladder(Quality(map="full"))] == [1.0]


@given(counts, st.integers(1, 11))
def test_lacking_samples_are_counted_cell_by_cell(held: np.ndarray, wanted: int) -> None:
    wanted = min(wanted, len(held) - 1)
    assert samples_lacking(held, wanted) == sum(cells * max(0, wanted - n) for n, cells in enumerate(held))


@pytest.mark.parametrize("deadline_ms", [0, -1, 600_001, float("nan"), "5", True])
def test_deadlines_out_of_range_are_refused(deadline_ms: float) -> None:
    with pytest.raises(SettingsError, match=r"quality\.deadline_ms: expected a number in \(0, 600000\]"):
        Quality(deadline_ms=deadline_ms)


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(tiling: str, deadline_ms: float | None, gaze_x: float = 20.0, samples: int | None = None) -> FrameRequest:
    quality = Quality(map=tiling, samples_per_cell=3, acuity=Acuity(scale=8.0), deadline_ms=deadline_ms)
    return FrameRequest(Gaze(gaze_x, 15), Display(64, 36, width_cm=6.0), None, quality, linear=True, samples=samples)


@pytest.mark.parametrize("tiling", MAPS)
def test_an_impossible_deadline_gives_the_coarsest_and_a_huge_one_the_full_frame(
    scene: PreparedScene, tiling: str
) -> None:
    scale = 8.0 if tiling == "full" else 64.0
    made, fresh = Renderer(threads=2), Renderer(threads=1)
    coarsest = made.render(scene, asked(tiling, 1e-6))
    assert (coarsest.cost.acuity_scale, coarsest.cost.samples_per_cell) == (scale, 1)
    assert (coarsest.cost.deadline_met, coarsest.cost.mean_samples) == (False, 1)
    assert coarsest.cost.deadline_promised is False
    coarse_quality = dataclasses.replace(asked(tiling, None).quality, acuity=Acuity(scale=scale))
    same = dataclasses.replace(asked(tiling, None, samples=1), quality=coarse_quality)
    np.testing.assert_array_equal(coarsest.pixels, fresh.render(scene, same).pixels)

    full = made.render(scene, asked(tiling, 600_000))
    assert (full.cost.acuity_scale, full.cost.samples_per_cell) == (8.0, 3)
    assert (full.cost.deadline_met, full.cost.mean_samples) == (True, 3)
    assert full.cost.deadline_promised is True
    assert made.render(scene, asked(tiling, None)).cost.deadline_promised is None
    np.testing.assert_array_equal(full.pixels, fresh.render(scene, asked(tiling, None)).pixels)
    assert full.cost.guessed_error == 0

    hurried = made.render(scene, asked(tiling, 1e-6, samples=2))
    assert (hurried.cost.samples_per_cell, hurried.cost.samples_traced) == (2, 0), "they are there"
    assert made.render(scene, asked(tiling, 600_000, 40.0, samples=2)).cost.samples_per_cell == 2
    made.close()
    fresh.close()


def test_cells_that_settled_for_fewer_samples_count_as_done(scene: PreparedScene) -> None:
    """With rates at which nothing can be traced, an adaptive frame that is there is shown whole."""
    made = Renderer(threads=2)
    wanted = asked("aligned", None)
    wanted = dataclasses.replace(
        wanted, quality=dataclasses.replace(wanted.quality, antialiasing="adaptive", samples_per_cell=24)
    )
    full = made.render(scene, wanted)
    assert full.cost.mean_samples < 24
    patient = Rates(1e9, 0.0, 1e9)
    made._pace.rates = lambda *_: patient  # type: ignore[method-assign]
    timed = dataclasses.replace(wanted, quality=dataclasses.replace(wanted.quality, deadline_ms=1000.0))
    again = made.render(scene, timed)
    assert (again.cost.acuity_scale, again.cost.samples_per_cell, again.cost.samples_traced) == (8.0, 24, 0)
    np.testing.assert_array_equal(again.pixels, full.pixels)
    made.close()


def test_samples_that_are_there_make_finer_frames_fit(scene: PreparedScene) -> None:
    """With rates at which nothing can be traced but a stored frame can be shown."""
    made = Renderer(threads=2)
    full = made.render(scene, asked("aligned", None))
    patient = Rates(1.0, 0.0, 1e9)
    made._pace.rates = lambda *_: patient  # type: ignore[method-assign]
    again = made.render(scene, asked("aligned", 1000))
    assert again.cost.deadline_promised is True, "nothing is left to trace"
    assert (again.cost.acuity_scale, again.cost.samples_per_cell, again.cost.samples_traced) == (8.0, 3, 0)
    np.testing.assert_array_equal(again.pixels, full.pixels)
    moved = made.render(scene, asked("aligned", 1000, 50.0))
    assert moved.cost.deadline_promised is False
    assert (moved.cost.acuity_scale, moved.cost.samples_per_cell) == (64.0, 1)
    made.close()
