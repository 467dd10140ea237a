"""The slope of five samples: of smooth functions, at the corner of a limiter, and beside one."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.linear.differences import KINK, STEP, _slope

SMOOTH: dict[str, tuple[Callable[[float], float], float]] = {
    "line": (lambda d: 3.0 - 2.0 * d, -2.0),
    "sine": (lambda d: np.sin(0.7 + d), np.cos(0.7)),
    "root": (lambda d: np.sqrt(1e-2 + d), 5.0),
    # A stabiliser's lead times its gain, bent by a product of states.
    "steep": (lambda d: 1e3 * d * (1.0 + d), 1e3),
    # So bent that its slopes differ by more than KINK from one sample to the next.
    "bent": (lambda d: np.exp(1e3 * d), 1e3),
    "vertex": (lambda d: d * d, 0.0),
    "saddle": (lambda d: d**3, 0.0),
}

HELD: dict[str, tuple[Callable[[float], float], float]] = {
    "at the top": (lambda d: min(d, 0.0), 0.0),
    "at the bottom": (lambda d: max(d, 0.0), 0.0),
    "at the edge of a deadband": (lambda d: -5.0 * max(d, 0.0), 0.0),
    "on a bent curve": (lambda d: min(np.exp(30.0 * d), 1.0), 0.0),
    "where the slope halves": (lambda d: 2.0 * d if d < 0 else d, 1.0),
    "where a held integrator lets go": (lambda d: 1.0 + 2.0 * d if d > 0 else 0.0, 0.0),
    "beyond the top": (lambda d: min(d, -3.0 * STEP), 0.0),
}

BESIDE: dict[str, Callable[[float], float]] = {
    "under the top": lambda d: min(d, 1.5 * STEP),
    "over the bottom": lambda d: max(d, -1.5 * STEP),
    "between both": lambda d: min(max(d, -1.5 * STEP), 1.5 * STEP),
}


def slope_of(function: Callable[[float], float]) -> float:
    return _slope(np.array([function(k * STEP) for k in (-2, -1, 0, 1, 2)], dtype=np.float64))


@pytest.mark.parametrize("name", SMOOTH)
def test_a_smooth_function_has_its_derivative(name: str) -> None:
    """Most of a system is smooth, and its modes are wanted to eight digits."""
    function, expected = SMOOTH[name]
    # Values near 1 are rounded to 1e-16, which over STEP is 1e-11; the rest is of STEP**4.
    assert slope_of(function) == pytest.approx(expected, rel=1e-8, abs=2e-9)


@pytest.mark.parametrize("name", HELD)
def test_at_a_corner_the_resting_side_counts(name: str) -> None:
    """What stands at its limit has no gain; half of it would be neither side's."""
    function, expected = HELD[name]
    assert slope_of(function) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", BESIDE)
def test_a_limit_beside_the_point_is_not_felt(name: str) -> None:
    """Samples that reach into a limiter must not take gain from a device that is free."""
    assert slope_of(BESIDE[name]) == pytest.approx(1.0, rel=1e-9)


slopes = st.floats(-1e3, 1e3)


@given(slopes, slopes)
def test_of_two_slopes_the_smaller_is_taken(left: float, right: float) -> None:
    """Either side of a corner may be the flat one, and both may have a slope."""
    found = slope_of(lambda d: (left if d < 0 else right) * d)
    # Slopes that differ by less than KINK are taken for one.
    allowed = KINK * max(abs(left), abs(right)) + 1e-12
    assert abs(abs(found) - min(abs(left), abs(right))) <= allowed
