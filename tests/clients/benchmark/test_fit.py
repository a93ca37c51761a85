"""The exponents by which time grows."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clients.command_line.benchmark.fit import fitted_power_law


@given(st.floats(1e-3, 1e3), st.floats(-3.0, 3.0))
def test_a_power_law_is_found_again(factor: float, exponent: float) -> None:
    sizes = (1.0, 3.0, 10.0, 250.0)
    law = fitted_power_law(sizes, [factor * size**exponent for size in sizes])
    assert law.exponent == pytest.approx(exponent, abs=1e-9)
    assert law.factor == pytest.approx(factor, rel=1e-9)
    assert law.at(7.0) == pytest.approx(factor * 7.0**exponent, rel=1e-8)


def test_what_grows_by_a_constant_share_a_decade_is_nearly_flat() -> None:
    """Time in the logarithm of the triangles."""
    law = fitted_power_law((1e3, 1e4, 1e5, 1e6), (3.0, 4.0, 5.0, 6.0))
    assert 0.0 < law.exponent < 0.12


@pytest.mark.parametrize(
    ("x", "y"), [((1.0,), (1.0,)), ((2.0, 2.0), (1.0, 3.0)), ((0.0, 1.0), (1.0, 1.0)), ((1.0, 2.0), (1.0,))]
)
def test_points_without_a_law_are_refused(x: tuple[float, ...], y: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="expected positive numbers, at least two different x"):
        fitted_power_law(x, y)
