"""Saturation, rectifier loading and deadband against their defining points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.grid.models.characteristics import (
    deadband,
    rectifier,
    rectifier_slope,
    rectifier_source,
    saturation,
    saturation_slope,
)

POINTS = (2.3, 0.1, 3.1, 0.33)


def array(*values: float) -> np.ndarray:
    return np.array(values)


def saturation_at(level: float, points: tuple[float, float, float, float] = POINTS) -> float:
    return float(saturation(array(level), *(array(value) for value in points))[0])


@given(
    st.floats(0.5, 3.0), st.floats(0.1, 2.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0)
)  # fmt: skip
def test_saturation_passes_through_both_points(
    E1: float, span: float, S1: float, more: float
) -> None:
    """The two points are all that a data sheet gives."""
    E2 = E1 + span
    S2 = S1 * E2 / E1 + more
    # Squares of square roots: a few last bits, of numbers up to ten.
    assert saturation_at(E1, (E1, S1, E2, S2)) == pytest.approx(S1, abs=1e-13 * (1 + S2) / span)
    assert saturation_at(E2, (E1, S1, E2, S2)) == pytest.approx(S2, abs=1e-13 * (1 + S2))


def test_saturation_is_zero_below_its_knee_and_without_points() -> None:
    """A machine whose data give no saturation must not have any."""
    root_1, root_2 = np.sqrt(2.3 * 0.1), np.sqrt(3.1 * 0.33)
    knee = 2.3 - root_1 * (3.1 - 2.3) / (root_2 - root_1)
    assert saturation_at(0.999 * knee) == 0.0
    assert saturation_at(0.0) == 0.0
    assert saturation_at(1.001 * knee) > 0.0
    assert saturation_at(5.0, (1.0, 0.0, 1.2, 0.0)) == 0.0


@pytest.mark.parametrize("level", [0.5, 2.0, 2.3, 4.0])
def test_the_declared_slope_is_the_derivative_of_e_times_s(level: float) -> None:
    """Linearised exciters stand on it."""
    h = 1e-6
    rise = (level + h) * saturation_at(level + h) - (level - h) * saturation_at(level - h)
    # Central differences of a piecewise parabola: exact up to rounding / h.
    assert saturation_slope(level, *POINTS) == pytest.approx(rise / (2 * h), abs=1e-9)


@pytest.mark.parametrize(
    ("I_N", "F_EX"),
    [
        (-0.1, 1.0),
        (0.0, 1.0),
        (0.2, 1 - 0.577 * 0.2),
        (0.433, 1 - 0.577 * 0.433),
        (0.6, np.sqrt(0.75 - 0.6**2)),
        (0.75, np.sqrt(0.75 - 0.75**2)),
        (0.9, 1.732 * (1 - 0.9)),
        (1.0, 0.0),
        (1.3, 0.0),
    ],
)
def test_rectifier_loading_is_the_standards(I_N: float, F_EX: float) -> None:
    """Annex D of IEEE Std 421.5-2016, at a supply of 2 pu."""
    # The standard rounds 1/sqrt(3), sqrt(3)/4 and sqrt(3) to three digits.
    assert rectifier(array(2.0), array(2.0 * I_N))[0] == pytest.approx(2.0 * F_EX, abs=4e-4)


@pytest.mark.parametrize("I_N", [0.0, np.sqrt(3) / 4, 0.75, 1.0])
def test_rectifier_loading_is_continuous_at_its_joints(I_N: float) -> None:
    """A jump in the supply would make a step of field voltage out of nothing."""
    around = rectifier(np.ones(3), I_N + array(-1e-12, 0.0, 1e-12))
    # Slopes are at most sqrt(3).
    assert np.ptp(around) < 1e-11


def test_a_rectifier_without_supply_gives_nothing() -> None:
    """An exciter's alternator may stand at 0 V; nothing is divided by it."""
    assert rectifier(array(0.0, 0.0), array(0.0, 0.3)).tolist() == [0.0, 0.0]


@given(st.floats(0.01, 10.0), st.floats(0.0, 10.0))
def test_the_source_of_a_rectified_voltage_gives_it_back(y: float, drop: float) -> None:
    """The initial point of an alternator exciter is found through it."""
    v = rectifier_source(array(y), array(drop))
    # The chord's square root loses digits where it is steep.
    assert rectifier(v, array(drop))[0] == pytest.approx(y, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("drop", [0.1, 0.6, 0.9, 1.2])
def test_the_declared_rectifier_slope_is_its_derivative(drop: float) -> None:
    """Linearised exciters stand on it."""
    h = 1e-6
    rise = rectifier(array(1 + h), array(drop)) - rectifier(array(1 - h), array(drop))
    assert rectifier_slope(1.0, drop) == pytest.approx(rise[0] / (2 * h), abs=1e-8)


@pytest.mark.parametrize(
    ("u", "y"), [(0.0004, 0.0), (-0.0006, 0.0), (0.001, 0.0004), (-0.01, -0.0094)]
)
def test_a_deadband_passes_what_lies_beyond_it(u: float, y: float) -> None:
    """Without a step at its edges, or a governor would chatter there."""
    assert deadband(array(u), array(0.0006))[0] == pytest.approx(y, abs=1e-18)
