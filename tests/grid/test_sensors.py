"""The frequency estimator against its transfer function, and angles that turn."""

from collections.abc import Callable

import numpy as np
import pytest

from tieline.grid.sensors import A1, B, Sensors, filter_angles, frequencies

F0_HZ = 60.0


def derivative(x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return dx/dt of the sensors of buses with these angles."""
    sensors = Sensors(np.arange(len(theta)), 0, F0_HZ, len(theta))
    dx = np.zeros_like(x)
    filter_angles(sensors, np.exp(1j * theta), x, dx)
    return dx


def track(theta: Callable[[float], float], duration_s: float, h: float = 1e-3) -> float:
    """Return what a sensor shows at the end of an angle's course, integrated by RK4."""
    x = np.array([theta(0.0), 0.0])

    def slope(t: float, at: np.ndarray) -> np.ndarray:
        return derivative(at, np.array([theta(t)]))

    for step in range(round(duration_s / h)):
        t = step * h
        k1 = slope(t, x)
        k2 = slope(t + h / 2, x + h / 2 * k1)
        k3 = slope(t + h / 2, x + h / 2 * k2)
        k4 = slope(t + h, x + h * k3)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return float(frequencies(Sensors(np.array([0]), 0, F0_HZ, 1), x)[0])


@pytest.mark.parametrize("frequency_hz", [0.01, 0.4, 1.0, 2.65, 20.0])
def test_from_angle_to_frequency_it_is_the_derivative_filter(frequency_hz: float) -> None:
    """b s / (s^2 + a1 s + b): its lag is part of every delay that a controller sees."""
    s = 2j * np.pi * frequency_hz
    theta, x0, step = np.array([0.7]), np.array([0.7, 0.0]), 1e-6

    def slope(of: Callable[[float], np.ndarray]) -> np.ndarray:
        return (of(step) - of(-step)) / (2 * step)

    a = np.array([slope(lambda d, e=e: derivative(x0 + d * e, theta)) for e in np.eye(2)]).T
    b = slope(lambda d: derivative(x0, theta + d))
    z = np.linalg.solve(s * np.eye(2) - a, b)
    # The equations are linear: what is left is the rounding of differences over 1e-6, times b.
    assert z[1] == pytest.approx(B * s / (s * s + A1 * s + B), rel=1e-6)


def test_its_two_constants_are_those_of_the_case() -> None:
    """Natural frequency 2.65 Hz and damping ratio 0.866: a filter that passes every swing."""
    assert np.sqrt(B) / (2 * np.pi) == pytest.approx(2.65, abs=1e-3)
    assert A1 / (2 * np.sqrt(B)) == pytest.approx(np.sqrt(3) / 2, abs=1e-3)


@pytest.mark.parametrize("theta", [-3.1, 0.0, 1.0, 3.1])
def test_a_bus_at_rest_shows_the_nominal_frequency(theta: float) -> None:
    """Any offset would push every average, and with it every stabiliser."""
    angles = np.array([theta])
    assert not derivative(np.array([theta, 0.0]), angles)[0]
    # exp and arctan2 return the angle up to their rounding, times b.
    assert abs(derivative(np.array([theta, 0.0]), angles)[1]) < 1e-12
    assert track(lambda t: theta, 1.0) == pytest.approx(F0_HZ, abs=1e-13)


@pytest.mark.parametrize("offset_hz", [-0.5, 0.5, 2.0])
def test_a_bus_angle_that_turns_many_times_shows_a_steady_frequency(offset_hz: float) -> None:
    """After a trip the angles turn for the rest of the run; each turn must pass unnoticed."""
    # Six turns at least; the transient has died out as exp(-a1/2 t) after two seconds.
    shown = track(lambda t: 2 * np.pi * offset_hz * t, 6 / abs(offset_hz))
    assert shown == pytest.approx(F0_HZ + offset_hz, abs=1e-9)


def test_a_turn_more_of_the_angle_or_of_the_state_changes_nothing() -> None:
    """A voltage does not know how often it has turned."""
    x, theta = np.array([0.4, 0.1]), np.array([0.9])
    plain = derivative(x, theta)
    for turns in (-3, 1, 40):
        moved = derivative(x + np.array([2 * np.pi * turns, 0.0]), theta)
        # The rounding of an angle of some 250 rad, times b.
        np.testing.assert_allclose(moved, plain, rtol=0, atol=1e-10)


def test_sensors_do_not_mix() -> None:
    """A state in the wrong half of the vector would show one bus's angle as another's frequency."""
    rng = np.random.default_rng(11)
    theta, x = rng.uniform(-1, 1, 5), rng.uniform(-1, 1, 10)
    together = derivative(x, theta)
    for k in range(5):
        alone = derivative(x[[k, 5 + k]], theta[k : k + 1])
        np.testing.assert_array_equal(together[[k, 5 + k]], alone)
