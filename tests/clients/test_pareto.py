"""The Pareto front is what its definition says."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from clients.report.pareto import pareto_front

FEW_VALUES = st.integers(0, 6).map(float)
"""So few that ties are common."""

POINTS = st.lists(st.tuples(FEW_VALUES | st.floats(0, 1e6), FEW_VALUES | st.floats(0, 1e6)), max_size=40)


def beats(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """As good in both, better in one."""
    return one[0] <= other[0] and one[1] <= other[1] and one != other


@given(points=POINTS)
def test_it_holds_the_settings_that_no_other_beats(points: list[tuple[float, float]]) -> None:
    front = pareto_front([time for time, _ in points], [loss for _, loss in points])
    unbeaten = {index for index, point in enumerate(points) if not any(beats(other, point) for other in points)}
    assert set(front) == unbeaten
    assert len(front) == len(unbeaten)


@given(points=POINTS)
def test_along_it_time_grows_and_loss_falls(points: list[tuple[float, float]]) -> None:
    along = [points[index] for index in pareto_front([time for time, _ in points], [loss for _, loss in points])]
    assert along == sorted(along)
    assert [loss for _, loss in along] == sorted((loss for _, loss in along), reverse=True)


def test_one_setting_is_a_front_and_none_has_none() -> None:
    assert pareto_front([5.0], [3.0]) == (0,)
    assert pareto_front([], []) == ()
