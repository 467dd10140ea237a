"""The integration methods: their order, and the interpolation of a delayed average."""

import numpy as np
import pytest

from grid.runs import G26_AT_100_MS, disturbed, speeds
from tieline.grid.integrate import METHODS
from tieline.grid.simulation import Grid
from tieline.grid.system import System
from tieline.grid.wbar import late_average


def swing(system: System, method: str, steps_per_second: int) -> np.ndarray:
    """Return the states 0.2 s after every rotor was kicked, without any limit in reach."""
    grid = Grid(system, method=method, steps_per_second=steps_per_second)
    omega = system.plan.average.omega
    grid._x[omega] += 2e-4 * np.sin(1.0 + np.arange(len(omega)))
    grid.advance(steps_per_second // 5)
    return grid.x


@pytest.mark.parametrize(
    ("method", "coarse", "order"), [("heun", 480, 2), ("rk3", 240, 3), ("rk4", 240, 4)]
)
def test_halving_the_step_shrinks_the_error_as_the_methods_order_says(
    system: System, method: str, coarse: int, order: int
) -> None:
    """A coupling evaluated at the wrong stage costs an order before it costs anything visible."""
    fine, finer = coarse * 2, coarse * 16
    exact = swing(system, "rk4", finer)
    errors = [np.abs(swing(system, method, rate) - exact).max() for rate in (coarse, fine)]
    # Asymptotically 2^order; the fastest state (0.02 s) is not far below these steps, so a quarter
    # of an order is allowed either way.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize(
    ("method", "coarse", "order"),
    [("heun", 480, 2), ("rk3", 240, 3), ("rk4", 240, 4), ("trapezoid", 240, 2)],
)
def test_an_event_in_mid_run_costs_no_order(
    system: System, method: str, coarse: int, order: int
) -> None:
    """The trip of G26 at 0.1 s, seen at 0.3 s: a step that reached across it is of order 1."""
    exact = disturbed(system, "rk4", 3840, G26_AT_100_MS)
    exact.advance(1152)
    errors = []
    for rate in (coarse, 2 * coarse):
        grid = disturbed(system, method, rate, G26_AT_100_MS)
        grid.advance(rate * 3 // 10)
        errors.append(np.abs(speeds(grid) - speeds(exact)).max())
    # As for the smooth swing above.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("half", [0, 1, 2])
def test_a_delayed_average_is_read_where_its_delay_points(half: int) -> None:
    """Off by one step, every delay would be wrong by one step."""
    delay, ticks = 5, 40
    history = np.ones(delay + 4)
    cubic = lambda t: 1.0 + 1e-3 * t - 2e-4 * t**2 + 1e-5 * t**3  # noqa: E731
    for tick in range(ticks + 1):
        history[tick % len(history)] = cubic(tick)
    expected = cubic(ticks - delay + half / 2)
    # A cubic is interpolated exactly up to rounding.
    assert late_average(history, ticks, delay, half) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("name", list(METHODS))
def test_a_tableau_is_consistent(name: str) -> None:
    """Weights that do not sum to one integrate another equation."""
    tableau = METHODS[name]
    assert tableau.b.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(tableau.a.sum(axis=1), tableau.half / 2, atol=1e-15)
