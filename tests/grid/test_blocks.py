"""Blocks against their transfer functions."""

from collections.abc import Callable

import numpy as np
import pytest

from tieline.grid.models.blocks import (
    clamp,
    lag,
    lag_non_windup,
    lead_lag,
    limited_integrator,
    limited_lag,
    rate_feedback,
    washout,
)

one = np.array([1.0])


def response(block: Callable[[complex, complex], tuple[complex, complex]], s: complex) -> complex:
    """Return output over input at `s`, with the state x = dx/dt / s solved from a linear block."""
    # dx = a x + b u and y = c x + d u, read off by unit inputs.
    b, a = block(1.0, 0.0)[1], block(0.0, 1.0)[1]
    d, c = block(1.0, 0.0)[0], block(0.0, 1.0)[0]
    return d + c * b / (s - a)


def scalar(block: Callable, *parameters: float) -> Callable:
    """Return a block as a function of numbers."""
    arrays = [np.array([value]) for value in parameters]

    def call(u: float, x: float) -> tuple[float, float]:
        y, dx = block(np.array([u]), np.array([x]), *arrays)
        return float(y[0]), float(dx[0])

    return call


@pytest.mark.parametrize("s", [0.3j, 2.0 + 1.0j, 40j])
@pytest.mark.parametrize(
    ("block", "parameters", "transfer"),
    [
        (washout, (10.0,), lambda s: 10 * s / (1 + 10 * s)),
        (lead_lag, (0.25, 0.04), lambda s: (1 + 0.25 * s) / (1 + 0.04 * s)),
        (lead_lag, (-1.0, 0.5), lambda s: (1 - s) / (1 + 0.5 * s)),
        (lag, (0.5,), lambda s: 1 / (1 + 0.5 * s)),
        (lag_non_windup, (200.0, 0.02, -1e9, 1e9), lambda s: 200 / (1 + 0.02 * s)),
        (limited_lag, (200.0, 0.02, -1e9, 1e9), lambda s: 200 / (1 + 0.02 * s)),
        (limited_integrator, (-1e9, 1e9), lambda s: 1 / s),
        (rate_feedback, (0.1, 0.675), lambda s: 0.1 * s / (1 + 0.675 * s)),
    ],
)
def test_a_block_has_the_transfer_function_of_its_name(
    s: complex, block: Callable, parameters: tuple[float, ...], transfer: Callable
) -> None:
    """Every exciter, governor and stabiliser is wired from these."""
    assert response(scalar(block, *parameters), s) == pytest.approx(transfer(s), rel=1e-12)


@pytest.mark.parametrize(("u", "x", "stops"), [(1.0, 5.0, True), (-1.0, 5.0, False)])
@pytest.mark.parametrize(
    ("block", "parameters"),
    [
        (lag_non_windup, (200.0, 0.02, -5.0, 5.0)),
        (limited_lag, (200.0, 0.02, -5.0, 5.0)),
        (limited_integrator, (-5.0, 5.0)),
    ],
)
def test_a_non_windup_limit_holds_and_releases_at_once(
    block: Callable, parameters: tuple[float, ...], u: float, x: float, stops: bool
) -> None:
    """A state that wound up behind its limit would keep the field forced for seconds too long."""
    call = scalar(block, *parameters)
    assert (call(u, x)[1] == 0.0) is stops
    assert (call(-u, -x)[1] == 0.0) is stops


def test_a_clamp_keeps_what_lies_between_its_limits() -> None:
    """A limit that moved what it allows would be a gain."""
    got = clamp(np.array([-2.0, 0.3, 2.0]), -one, one)
    np.testing.assert_array_equal(got, [-1.0, 0.3, 1.0])


def test_a_state_that_a_moving_limit_left_behind_follows_it() -> None:
    """A ceiling that falls with the voltage must not leave a store of field above it."""
    # K u = 8 drives against the limit, which has fallen from 5 to 3.
    y, dx = scalar(limited_lag, 200.0, 0.02, -5.0, 3.0)(0.04, 5.0)
    assert y == 3.0
    assert dx == pytest.approx((3.0 - 5.0) / 0.02, rel=1e-15)


@pytest.mark.parametrize(("u", "y"), [(0.01, 2.0), (0.04, 5.0), (-0.04, -5.0)])
def test_a_limited_lag_without_time_constant_is_a_limited_gain(u: float, y: float) -> None:
    """T_A = 0 stands in half of the published data."""
    assert scalar(limited_lag, 200.0, 0.0, -5.0, 5.0)(u, 1.0) == (y, 0.0)


def test_a_rate_feedback_without_time_constant_is_none() -> None:
    """K_F = T_F = 0 means that there is no stabilising feedback."""
    assert scalar(rate_feedback, 0.0, 0.0)(3.0, 1.0) == (0.0, 0.0)
