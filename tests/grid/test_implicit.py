"""The implicit trapezoidal method: its rule, its order, stiffness, failure, sameness of bits."""

from dataclasses import replace

import numpy as np
import pytest

from grid.runs import FAULT_AT_100_MS, G26_AT_100_MS, disturbed, kicked, speeds, with_values
from tieline.errors import NumericalError
from tieline.grid import implicit
from tieline.grid.case import Case
from tieline.grid.equations import rhs
from tieline.grid.models.registry import models
from tieline.grid.newton import TOLERANCE
from tieline.grid.powerflow import PowerFlow
from tieline.grid.simulation import Grid
from tieline.grid.system import System, build_system, rotor_average, sensor_average

H = 1 / 60


def derivatives(system: System, x: np.ndarray) -> np.ndarray:
    """The right-hand side with the network of rest."""
    work = type(system.work)._make(array.copy() for array in system.work)
    dx = np.zeros_like(x)
    assert rhs(system.functions, system.plan, work, x, dx)
    return dx


def full_jacobian(system: System, x: np.ndarray) -> np.ndarray:
    """df/dx of the whole system at once, the averages' coupling included."""
    step, columns = 1e-6, []
    for i in range(len(x)):
        sides = []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[i] += sign * step
            sides.append(derivatives(system, moved))
        columns.append((sides[0] - sides[1]) / (2.0 * step))
    return np.array(columns).T


def test_a_step_satisfies_the_trapezoidal_rule_to_the_stated_tolerance(system: System) -> None:
    """An iteration that stops early integrates some other equation, of order one."""
    grid = kicked(system, "trapezoid", 60)
    x0 = grid.x
    grid.advance(1)
    x1 = grid.x
    residual = x0 + 0.5 * H * (derivatives(system, x0) + derivatives(system, x1)) - x1
    newton = np.eye(len(x1)) - 0.5 * H * full_jacobian(system, x1)
    # What an exact Newton step would still change is the error of the solution.
    left = np.linalg.solve(newton, residual)
    assert np.abs(left / np.maximum(1.0, np.abs(x1))).max() < TOLERANCE
    assert np.abs(x1 - x0).max() > 1e-3


def test_halving_the_step_quarters_the_error(system: System) -> None:
    """Order 2, measured on a smooth swing."""
    exact = kicked(system, "rk4", 1920)
    exact.advance(384)
    errors = []
    for rate in (120, 240):
        grid = kicked(system, "trapezoid", rate)
        grid.advance(rate // 5)
        errors.append(np.abs(grid.x - exact.x).max())
    # The fastest state (0.02 s) is near these steps: a quarter of an order is allowed.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25)


def test_the_trip_of_g26_agrees_with_rk4_within_the_error_that_the_order_predicts(
    system: System,
) -> None:
    """1/60 s is the step that a user will take: it must be good for more than a picture."""
    ends = {}
    for method, rate in (("rk4", 960), ("trapezoid", 60), ("trapezoid", 120)):
        grid = disturbed(system, method, rate, G26_AT_100_MS)
        ends[rate] = []
        for second in range(1, 7):
            grid.advance(second * rate // 2)
            ends[rate].append(speeds(grid))
    exact, coarse, fine = (np.array(ends[rate]) for rate in (960, 60, 120))
    # Of order 2, e(h) - e(h/2) = 3/4 e(h); 5 % for the terms beyond.
    predicted = np.abs(coarse - fine).max() * 4 / 3
    assert np.abs(coarse - exact).max() == pytest.approx(predicted, rel=0.05)
    assert np.abs(coarse - exact).max() < 3e-6


def test_a_stiff_set_that_rk4_cannot_step_at_60_hertz_is_stable_and_right(
    tuned: Case, flow: PowerFlow
) -> None:
    """Published parameter sets have such constants; no user should have to find out why."""
    case = with_values(tuned, "exciter", TA=0.002)
    case = with_values(case, "machine", Tq0_pp=0.005)
    system = build_system(case, flow, case.base.sensors)
    broken = disturbed(system, "rk4", 60, G26_AT_100_MS)
    broken.advance(60)
    assert broken.ending is not None
    coarse = disturbed(system, "trapezoid", 60, G26_AT_100_MS)
    fine = disturbed(system, "rk4", 960, G26_AT_100_MS)
    for second in range(1, 5):
        coarse.advance(second * 60)
        fine.advance(second * 960)
        # As on the set that is not stiff: the swings decide, not the constants below the step.
        assert np.abs(speeds(coarse) - speeds(fine)).max() < 3e-6


def test_a_regulator_thirty_times_faster_than_the_step_does_not_stall_the_iteration(
    tuned: Case, flow: PowerFlow
) -> None:
    """Newton's iterates jump from one end of its limiter to the other, unless they are damped."""
    case = with_values(tuned, "exciter", TA=0.0005)
    case = with_values(case, "machine", Tq0_pp=0.002)
    system = build_system(case, flow, case.base.sensors)
    grid = disturbed(system, "trapezoid", 60, G26_AT_100_MS)
    reference = disturbed(system, "rk4", 4800, G26_AT_100_MS)
    grid.advance(60)
    reference.advance(4800)
    assert grid.ending is None
    # The ripple that the method leaves in so fast a state adds to the error of the swings.
    assert np.abs(speeds(grid) - speeds(reference)).max() < 1e-5


@pytest.mark.parametrize("model", sorted(models("exciter")))
def test_every_exciter_comes_through_a_fault_with_the_second_order(
    tuned: Case, flow: PowerFlow, model: str
) -> None:
    """Limits that move with the voltage, bypassed blocks, saturation: all of it in one step."""
    kind = models("exciter")[model]
    fitted = tuple(
        replace(device, model=kind, values=dict(kind.example)) if device.unit == "G3" else device
        for device in tuned.devices["exciter"]
    )
    case = replace(tuned, devices={**tuned.devices, "exciter": fitted})
    system = build_system(case, flow, case.base.sensors)
    ends = []
    for method, rate in (("rk4", 960), ("trapezoid", 60), ("trapezoid", 120)):
        grid = disturbed(system, method, rate, FAULT_AT_100_MS)
        grid.advance(rate)
        ends.append(speeds(grid))
    coarse, fine = (np.abs(end - ends[0]).max() for end in ends[1:])
    # The fault accelerates the machines by 1e-2; the instants of limits fall anywhere in a step.
    assert coarse < 3e-5
    assert fine < coarse / 3


def test_a_grid_at_rest_stays_at_rest(system: System) -> None:
    """Drift without a disturbance would be mistaken for dynamics."""
    grid = Grid(system, method="trapezoid", steps_per_second=60)
    grid.advance(600)
    # A correction below the tolerance is not taken any further, but it does not add up either.
    assert np.abs(grid.signal("omega") - 1.0).max() < 1e-10
    assert np.abs(np.abs(grid.voltages()) - system.flow.v).max() < 1e-9


@pytest.mark.parametrize("stops", [(1, 2, 3, 50, 120), (60, 120), (6, 7, 119, 120)])
def test_the_way_of_stepping_does_not_change_a_bit(system: System, stops: tuple[int, ...]) -> None:
    """The matrices that are kept must not remember where the federation met."""
    whole = disturbed(system, "trapezoid", 60, G26_AT_100_MS)
    whole.advance(120)
    parts = disturbed(system, "trapezoid", 60, G26_AT_100_MS)
    for stop in stops:
        parts.advance(stop)
        parts.reading()
    np.testing.assert_array_equal(parts.x, whole.x)


@pytest.mark.parametrize("kind", ["sensors", "rotors"])
@pytest.mark.parametrize("delay_ms", [0, 50, 250])
def test_a_late_average_comes_as_late_as_with_rk4(
    tuned: Case, flow: PowerFlow, kind: str, delay_ms: int
) -> None:
    """Both ends of a step read the delay line; half a step of error would cost an order."""
    errors = []
    for rate in (60, 120):
        grids = []
        for method, steps in (("trapezoid", rate), ("rk4", 960)):
            late = delay_ms * steps // 1000
            if kind == "sensors":
                average = sensor_average(np.ones(30), late)
            else:
                average = rotor_average(np.ones(34), late)
            system = build_system(tuned, flow, tuned.base.sensors, average)
            grid = disturbed(system, method, steps, G26_AT_100_MS)
            grid.advance(steps)
            grids.append(grid)
        errors.append(abs(grids[0].signal("wbar")[0] - grids[1].signal("wbar")[0]))
    # The average has moved by 1e-3; a delay wrong by half a step of 1/60 s would show as 1e-5.
    assert errors[0] < 2e-6
    assert errors[1] < max(errors[0] / 2, 1e-8)


def test_a_delay_of_one_step_is_allowed(tuned: Case, flow: PowerFlow) -> None:
    """The step's end then reads what its start has just written."""
    system = build_system(tuned, flow, tuned.base.sensors, sensor_average(np.ones(30), 1))
    grid = disturbed(system, "trapezoid", 60, G26_AT_100_MS)
    grid.advance(59)
    earlier = 1.0 + (grid.reading().f_hz.mean() - 60.0) / 60.0
    grid.advance(60)
    # Two ways of summing thirty numbers of size 1e-3.
    assert grid.signal("wbar")[0] == pytest.approx(earlier, abs=1e-14)


def test_a_belief_acts_from_its_instant_on(tuned: Case, flow: PowerFlow) -> None:
    """A delivery is a jump of the input like any event: no step reaches across it."""
    system = build_system(tuned, flow, tuned.base.sensors, sensor_average(np.ones(30), mode=0))
    ends = []
    for method, rate in (("rk4", 1920), ("trapezoid", 240), ("trapezoid", 480)):
        grid = Grid(system, method=method, steps_per_second=rate)
        # Small enough to leave every stabiliser within its limits.
        told = np.repeat([[0.9999], [1.0001], [0.99995], [1.0]], 34, axis=1)
        grid.expect(np.arange(4) * rate // 20, told)
        grid.advance(4 * rate // 20)
        ends.append(speeds(grid))
    coarse, fine = (np.abs(end - ends[0]).max() for end in ends[1:])
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.25)


def test_a_step_that_does_not_converge_names_the_time_and_the_worst_state(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step that was not solved must never be handed on as a result."""
    monkeypatch.setattr(implicit, "MAX_ITERATIONS", 1)
    monkeypatch.setattr(implicit, "NEWTON_ITERATIONS", 1)
    grid = kicked(system, "trapezoid", 60)
    before = grid.x
    with pytest.raises(NumericalError, match=r"from t = 0\.0000 s did not converge, \S+ least"):
        grid.advance(1)
    np.testing.assert_array_equal(grid.x, before)
    assert grid.tick == 0


def test_a_step_that_fails_is_tried_again_with_fresh_matrices(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Matrices that have aged are no reason to end a run."""
    smooth = kicked(system, "trapezoid", 60)
    smooth.advance(1)
    monkeypatch.setattr(implicit, "MAX_ITERATIONS", 1)
    again = kicked(system, "trapezoid", 60)
    again.advance(1)
    assert np.abs(again.x - smooth.x).max() < 2 * TOLERANCE
