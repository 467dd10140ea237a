"""Blocks against their transfer functions."""

from collections.abc import Callable

import numpy as np
import pytest

from tieline.grid.models.blocks import clamp, lag, lag_non_windup, lead_lag, washout

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
    ],
)
def test_a_block_has_the_transfer_function_of_its_name(
    s: complex, block: Callable, parameters: tuple[float, ...], transfer: Callable
) -> None:
    """Every exciter, governor and stabiliser is wired from these."""
    assert response(scalar(block, *parameters), s) == pytest.approx(transfer(s), rel=1e-12)


@pytest.mark.parametrize(("u", "x", "stops"), [(1.0, 5.0, True), (-1.0, 5.0, False)])
def test_a_non_windup_limit_holds_and_releases_at_once(u: float, x: float, stops: bool) -> None:
    """A state that wound up behind its limit would keep the field forced for seconds too long."""
    call = scalar(lag_non_windup, 200.0, 0.02, -5.0, 5.0)
    assert (call(u, x)[1] == 0.0) is stops
    assert (call(-u, -x)[1] == 0.0) is stops


def test_a_clamp_keeps_what_lies_between_its_limits() -> None:
    """A limit that moved what it allows would be a gain."""
    got = clamp(np.array([-2.0, 0.3, 2.0]), -one, one)
    np.testing.assert_array_equal(got, [-1.0, 0.3, 1.0])
