"""The blocks that a zero bypasses, and the second-order one, against their transfer functions."""

from collections.abc import Callable

import numpy as np
import pytest

from tieline.grid.models.blocks import (
    gain_lead_lag,
    lag_or_pass,
    lead_lag,
    lead_lag_or_pass,
    leads_without_lags,
    second_order,
    second_order_at,
    washout,
    washout_at,
    washout_or_pass,
)

U, X0 = np.array([0.7, -0.2, 1.1]), np.array([0.1, 0.4, -0.3])


def response(
    block: Callable[..., tuple[np.ndarray, ...]], s: complex, states: int, parameters: tuple
) -> complex:
    """Return output over input at `s` of a linear block, from its answers to unit arguments."""

    def at(u: float, x: list[float]) -> np.ndarray:
        arrays = [np.array([value]) for value in (u, *x)]
        return np.array([row[0] for row in block(*arrays, *parameters)])

    rest = [0.0] * states
    of_input = at(1.0, rest)
    of_states = np.array(
        [at(0.0, [float(i == k) for i in range(states)]) for k in range(states)]
    ).reshape(states, states + 1)
    x = np.linalg.solve(s * np.eye(states) - of_states[:, 1:].T, of_input[1:])
    return of_input[0] + of_states[:, 0] @ x


def numbers(*values: float) -> tuple[np.ndarray, ...]:
    return tuple(np.array([value]) for value in values)


@pytest.mark.parametrize("s", [0.3j, 2.0 + 1.0j, 40j])
@pytest.mark.parametrize(
    ("block", "parameters", "transfer"),
    [
        (washout_or_pass, (10.0,), lambda s: 10 * s / (1 + 10 * s)),
        (washout_or_pass, (0.0,), lambda s: 1.0),
        (lag_or_pass, (0.5,), lambda s: 1 / (1 + 0.5 * s)),
        (lag_or_pass, (0.0,), lambda s: 1.0),
        (lead_lag_or_pass, (0.25, 0.04), lambda s: (1 + 0.25 * s) / (1 + 0.04 * s)),
        (lead_lag_or_pass, (0.0, 0.0), lambda s: 1.0),
        (gain_lead_lag, (0.4, 0.25, 0.04), lambda s: (0.4 + 0.25 * s) / (1 + 0.04 * s)),
        (gain_lead_lag, (0.4, 0.0, 0.0), lambda s: 0.4),
    ],
)
def test_a_block_has_its_transfer_function_or_passes_its_input(
    s: complex, block: Callable, parameters: tuple[float, ...], transfer: Callable
) -> None:
    """A zero that a standard calls 'bypassed' must neither divide nor block the signal."""
    # A bypassed state never moves, so that s I - A keeps its inverse on every s but 0.
    got = response(block, s, 1, numbers(*parameters))
    assert got == pytest.approx(transfer(s), rel=1e-12)


@pytest.mark.parametrize("s", [0.3j, 2.0 + 1.0j, 40j])
@pytest.mark.parametrize(
    ("b1", "b2", "a1", "a2"),
    [
        (0.0, 0.0, 0.061, 0.0017),
        (-1.759e-3, 0.0, 1.7823e-2, 1.2739e-4),
        (0.0, 1e-4, 2e-3, 1e-4),
        (0.2, 0.0, 0.5, 0.0),
        (0.0, 0.0, 0.0, 0.0),
    ],
)
def test_the_second_order_block_falls_back_to_the_first_and_to_a_wire(
    s: complex, b1: float, b2: float, a1: float, a2: float
) -> None:
    """The standard's filters are switched off by zeros, one coefficient at a time."""
    parameters = (numbers(b1, b2), numbers(a1, a2))
    got = response(second_order, s, 2, parameters)
    assert got == pytest.approx(second_order_at(s, b1, b2, a1, a2), rel=1e-12)


def test_a_notch_stops_its_frequency() -> None:
    """(s^2 + wn^2) / (s^2 + Bw s + wn^2) is zero at wn; that is its whole purpose."""
    wn, Bw = 100.0, 10.0
    parameters = (numbers(0.0, wn**-2), numbers(Bw / wn**2, wn**-2))
    assert abs(response(second_order, 1j * wn, 2, parameters)) < 1e-12
    # Half the bandwidth beside it the power is halved: |s^2 + wn^2| = Bw |s| there.
    edge = np.sqrt(wn**2 + Bw**2 / 4) + Bw / 2
    got = abs(response(second_order, 1j * edge, 2, parameters))
    assert got == pytest.approx(np.sqrt(0.5), rel=1e-9)


def test_blocks_that_are_not_bypassed_equal_the_plain_ones_to_the_last_bit() -> None:
    """The generalised stabiliser must stay the standard one wherever both weights are equal."""
    T1, T2 = np.array([0.25, 0.2, 3.0]), np.array([0.04, 0.03, 5.4])
    for one, other in zip(lead_lag_or_pass(U, X0, T1, T2), lead_lag(U, X0, T1, T2), strict=True):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(washout_or_pass(U, X0, T1), washout(U, X0, T1), strict=True):
        np.testing.assert_array_equal(one, other)


def test_units_with_and_without_a_block_stand_side_by_side() -> None:
    """One unit's zero must not switch off its neighbour's filter."""
    T = np.array([0.0, 2.0, 0.0])
    y, rate = lag_or_pass(U, X0, T)
    np.testing.assert_array_equal(y, [U[0], X0[1], U[2]])
    np.testing.assert_array_equal(rate, [0.0, (U[1] - X0[1]) / 2.0, 0.0])


def test_a_lead_without_its_lag_is_named() -> None:
    """1 + s T alone is a differentiator, which nothing can build."""
    pairs = (("T1", "T2"), ("T3", "T4"), ("T5", "T6"))
    values = {"T1": 0.3, "T2": 0.0, "T3": 0.0, "T4": 0.0, "T5": 0.1, "T6": 0.1}
    assert leads_without_lags(values, pairs) == [
        "needs T2 > 0 s beside T1 = 0.3 s; both 0 bypass the block"
    ]


def test_the_declared_washout_is_one_where_it_is_bypassed() -> None:
    """Declared transfer functions follow the same rule as the equations."""
    assert washout_at(1j, 0.0) == 1.0
    assert washout_at(1j, 10.0) == pytest.approx(10j / (1 + 10j))
