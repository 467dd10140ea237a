"""Modes followed through growing delays, and the delay at which the loop becomes unstable."""

from math import e, pi

import numpy as np
import pytest
from scipy.special import lambertw

from linear.delayed_loops import UNEQUAL, distance, growing, inside, scalar, two_area
from tieline.errors import InputError, NumericalError
from tieline.linear.delay import (
    damping_against_delay,
    delay_crossings,
    delay_margin,
    delayed_eigenvalues,
    mode_with_delay,
    refined_mode,
)


@pytest.mark.parametrize("a", [0.4, 3.0])
def test_the_scalar_equation_has_its_known_margin(a: float) -> None:
    """x' = -a x(t - tau) swings undamped at w = a when tau is pi / (2 a)."""
    margin = delay_margin(scalar(a))
    assert margin is not None
    assert margin.is_stable_without_delay
    assert margin.delay_s == pytest.approx(pi / (2.0 * a), rel=1e-12)
    assert margin.f_hz == pytest.approx(a / (2.0 * pi), rel=1e-12)
    assert delay_margin(scalar(a), longest_s=0.99 * pi / (2.0 * a)) is None


def test_a_real_root_is_followed_until_it_meets_another() -> None:
    """At a tau = 1/e two real roots become a pair: there is no telling which is which."""
    a = 2.0
    delays = np.linspace(0.0, 0.98 / (a * e), 5)[1:]
    path = mode_with_delay(scalar(a), -a, delays)
    np.testing.assert_allclose(path, lambertw(-a * delays, 0) / delays, rtol=1e-11)
    with pytest.raises(NumericalError, match=r"cannot be followed beyond the delays \[0\.1839"):
        mode_with_delay(scalar(a), -a, [0.3])
    against = damping_against_delay(scalar(a), [0.1, 0.3, 0.4], [-a])
    assert against.is_lost[:, 0].tolist() == [False, True, True]


def test_the_standard_stabiliser_does_not_feel_the_delay() -> None:
    """With beta1 = beta2 the average cancels; 1e-9 is the rounding of the eigenvalues."""
    linear = two_area(25.0, 1.0, 1.0)
    undelayed = inside(np.linalg.eigvals(linear.A))
    for delays_s in (0.2, 1.25, UNEQUAL):
        assert distance(undelayed, delayed_eigenvalues(linear, delays_s)) < 1e-9
    against = damping_against_delay(linear, [0.5, 1.25], undelayed)
    np.testing.assert_allclose(against.eigenvalues, np.tile(against.undelayed, (2, 1)), rtol=1e-12)
    assert delay_margin(linear) is None
    assert delay_crossings(linear) == ()


def test_modes_followed_are_eigenvalues_of_every_delay() -> None:
    """A path that jumped, or stepped off the equation, would end beside them."""
    linear, delays = two_area(), np.array([0.05, 0.3, 0.8, 1.25])
    start = inside(np.linalg.eigvals(linear.A))
    against = damping_against_delay(linear, delays, start)
    assert not against.is_lost.any()
    assert distance(start, against.undelayed) < 1e-9
    for delay_s, row in zip(delays, against.eigenvalues, strict=True):
        assert distance(row, delayed_eigenvalues(linear, delay_s)) < 1e-8
        assert np.unique(row.round(6)).size == np.unique(start.round(6)).size
    slowest = against.eigenvalues[:, np.argmin(start.imag)]
    np.testing.assert_array_less(np.diff(slowest.imag), 0.0)
    there = damping_against_delay(linear, [UNEQUAL], start)
    assert distance(there.eigenvalues[0], delayed_eigenvalues(linear, UNEQUAL)) < 1e-8


def test_the_default_modes_are_those_of_the_band() -> None:
    """Modes below 0.02 Hz and above 2.5 Hz are no business of the average."""
    against = damping_against_delay(two_area(), [0.0])
    assert (np.diff(against.undelayed.imag) >= 0.0).all()
    np.testing.assert_allclose(against.eigenvalues[0], against.undelayed)
    values = np.linalg.eigvals(two_area().A)
    f_hz = values.imag / (2.0 * pi)
    assert against.f_hz.shape == (1, int(((f_hz >= 0.02) & (f_hz <= 2.5)).sum()))


def test_the_delay_margin_parts_stable_from_unstable() -> None:
    """0.1 % before the margin nothing grows, 0.1 % beyond one pair does, at that frequency."""
    linear = two_area()
    margin = delay_margin(linear)
    assert margin is not None
    assert margin.is_stable_without_delay
    assert 0.1 < margin.delay_s < 0.5
    assert growing(linear, 0.999 * margin.delay_s) == 0
    assert growing(linear, 1.001 * margin.delay_s) == 2
    mode = refined_mode(linear, 2j * pi * margin.f_hz, margin.delay_s)
    assert abs(mode.eigenvalue - 2j * pi * margin.f_hz) < 1e-9


@pytest.mark.parametrize(("gain", "beta1", "beta2"), [(18.0, 1.0, 0.0), (25.0, 0.0, 1.0)])
def test_every_crossing_carries_one_pair_over(gain: float, beta1: float, beta2: float) -> None:
    """Between crossings the count of growing modes is what they add up to: none is missing."""
    linear = two_area(gain, beta1, beta2)
    found = delay_crossings(linear, 1.3)
    assert len(found) >= 5
    assert {c.destabilises for c in found} == {True, False}
    at = [c.delay_s for c in found]
    assert at == sorted(at)
    expected = growing(linear, 0.0)
    for crossing, until in zip(found, [*at[1:], 1.3], strict=True):
        expected += 2 if crossing.destabilises else -2
        assert growing(linear, 0.5 * (crossing.delay_s + until)) == expected


def test_a_loop_that_is_unstable_without_delay_has_no_margin() -> None:
    """A first crossing to the left must not be sold as a margin."""
    linear = two_area(25.0, 0.0, 1.0)
    margin = delay_margin(linear)
    assert margin is not None
    assert not margin.is_stable_without_delay
    assert margin.delay_s == 0.0
    unstable = np.array(margin.unstable_without_delay)
    assert 2 * len(unstable) == growing(linear, 0.0)
    assert (unstable.real > 0.0).all()
    assert distance(unstable, np.linalg.eigvals(linear.A)) < 1e-9
    assert margin.f_hz == pytest.approx(unstable[0].imag / (2.0 * pi))


def test_arguments_are_checked() -> None:
    """Each message names what was given and what is allowed."""
    linear = two_area()
    with pytest.raises(InputError, match=r"longest_s must be > 0 and <= 10\.0 s \(got -1\.0\)"):
        delay_margin(linear, longest_s=-1.0)
    with pytest.raises(InputError, match=r"has no mode at 20j 1/s \(the nearest is"):
        mode_with_delay(linear, 20j, [0.1])
    with pytest.raises(InputError, match=r"list of delays.* \(got shape \(\)\)"):
        mode_with_delay(linear, 1j, 0.1)  # type: ignore[arg-type]
