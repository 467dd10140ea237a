"""The grid in motion: rest, stepping, events, failure."""

import numpy as np
import pytest

from tieline.errors import NumericalError
from tieline.grid.case import Case
from tieline.grid.events import Disturbance, plan_events
from tieline.grid.powerflow import PowerFlow
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import System, build_system, rotor_average, sensor_average


def trip(case: Case, at: float = 0.0, rate: int = 240) -> list[Disturbance]:
    """The trip of G26, on a grid of `rate` steps a second."""
    events = [{"at": at, "trip_generator": "G26"}]
    settings = GridSettings(duration=10.0, steps_per_second=rate, events=events)
    return plan_events(case, settings)


def test_a_grid_at_rest_stays_at_rest(system: System) -> None:
    """Drift without a disturbance would be mistaken for dynamics."""
    grid = Grid(system, method="rk4", steps_per_second=240)
    grid.advance(2400)
    # Roundings of 1e-16 relative, times an exciter gain of 200 and 10 s of integration.
    assert np.abs(grid.signal("omega") - 1.0).max() < 1e-10
    assert np.abs(np.abs(grid.voltages()) - system.flow.v).max() < 1e-9


@pytest.mark.parametrize("stops", [(1, 2, 3, 50, 120), (60, 120), (119, 120)])
def test_the_way_of_stepping_does_not_change_a_bit(
    system: System, tuned: Case, stops: tuple[int, ...]
) -> None:
    """A federation that meets more often must not get another answer."""
    whole = Grid(system, method="rk4", steps_per_second=240, events=trip(tuned, 0.05))
    whole.advance(120)
    parts = Grid(system, method="rk4", steps_per_second=240, events=trip(tuned, 0.05))
    for stop in stops:
        parts.advance(stop)
        parts.reading()
    np.testing.assert_array_equal(parts.x, whole.x)


def test_an_event_moves_voltages_at_its_tick_and_states_only_after_it(
    system: System, tuned: Case
) -> None:
    """An event a step early or late shifts every curve against every other program's."""
    grid = Grid(system, method="heun", steps_per_second=480, events=trip(tuned, 0.1, 480))
    grid.advance(47)
    assert np.abs(np.abs(grid.voltages()) - system.flow.v).max() < 1e-9
    grid.advance(48)
    assert np.abs(grid.x - system.x0).max() < 1e-9
    g26 = tuned.units.index("G26")
    assert grid.signal("Pe")[g26] == pytest.approx(0.0, abs=1e-9)
    assert not grid.in_service[g26]


def test_a_tripped_unit_leaves_the_centre_of_inertia_and_the_rotor_average(
    tuned: Case, flow: PowerFlow
) -> None:
    """A unit that runs away alone says nothing about the interconnection's frequency."""
    average = rotor_average(np.ones(34))
    system = build_system(tuned, flow, tuned.base.sensors, average)
    grid = Grid(system, method="rk4", steps_per_second=240, events=trip(tuned))
    grid.advance(480)
    speed = grid.signal("omega")
    g26 = tuned.units.index("G26")
    assert speed[g26] > 1.05
    rest = np.delete(speed, g26)
    assert grid.signal("wbar")[0] == pytest.approx(rest.mean(), abs=1e-14)
    assert rest.min() < grid.centre_of_inertia() < rest.max()


def test_a_held_belief_reaches_the_stabilisers_until_the_next_one(
    tuned: Case, flow: PowerFlow
) -> None:
    """What a controller believes is all that it may use of the wide area."""
    average = sensor_average(np.ones(30), mode=0)
    system = build_system(tuned, flow, tuned.base.sensors, average)
    grid = Grid(system, method="rk4", steps_per_second=240)
    grid.expect(np.array([0]), np.full((1, 34), 0.999))
    # nu = (beta1 - beta2) (omega - wbar) > 0 before any rotor has moved.
    assert (grid.signal("v_s") > 0).all()
    grid.advance(24)
    np.testing.assert_array_equal(grid.signal("wbar"), np.full(34, 0.999))


@pytest.mark.parametrize("method", ["rk4", "trapezoid"])
def test_averages_expected_ahead_act_when_they_are_due(
    method: str, tuned: Case, flow: PowerFlow
) -> None:
    """Told all at once or each in its turn, to the last bit."""
    system = build_system(tuned, flow, tuned.base.sensors, sensor_average(np.ones(30), mode=0))
    due, told = np.array([0, 3, 7]), np.repeat([[0.9999], [1.0001], [1.0]], 34, axis=1)
    ahead, in_turn = (Grid(system, method=method, steps_per_second=240) for _ in range(2))
    ahead.expect(due, told)
    ahead.advance(12)
    for k, tick in enumerate(due):
        in_turn.advance(int(tick))
        in_turn.expect(due[k : k + 1], told[k : k + 1])
    in_turn.advance(12)
    np.testing.assert_array_equal(ahead.x, in_turn.x)
    assert np.abs(ahead.x - system.x0).max() > 1e-6


def test_a_delayed_average_equals_the_undelayed_one_of_earlier(
    tuned: Case, flow: PowerFlow
) -> None:
    """The delay line is the whole of the `constant` engine when reporting is continuous."""
    average = sensor_average(np.ones(30), delay_steps=24)
    system = build_system(tuned, flow, tuned.base.sensors, average)
    grid = Grid(system, method="rk4", steps_per_second=240, events=trip(tuned))
    now = {}
    for tick in range(1, 121):
        grid.advance(tick)
        now[tick] = 1.0 + (grid.reading().f_hz.mean() - 60.0) / 60.0
    # Two ways of summing thirty numbers of size 1e-3.
    assert grid.signal("wbar")[0] == pytest.approx(now[120 - 24], abs=1e-14)


def test_the_sensors_settle_on_the_frequency_of_the_island(system: System, tuned: Case) -> None:
    """The filter has unity gain at rest of the frequency, whatever the angle has wound up to."""
    grid = Grid(system, method="rk4", steps_per_second=240, events=trip(tuned))
    grid.advance(240 * 30)
    reading = grid.reading()
    coi_hz = 60.0 * grid.centre_of_inertia()
    # Thirty seconds after the trip the frequency moves by less than 1 mHz/s; the filter's lag of
    # a1/b = 0.1 s is worth 0.1 mHz, what is left of the swings 1 mHz.
    assert np.abs(reading.f_hz - coi_hz).max() < 1e-3
    assert np.abs(reading.rocof_hz_s).max() < 1e-2


def test_time_does_not_run_backwards(system: System) -> None:
    """A tick that lies behind is a broken contract, not a no-op."""
    grid = Grid(system, method="rk4", steps_per_second=240)
    grid.advance(10)
    with pytest.raises(ValueError, match="tick 9 lies before the current one, 10"):
        grid.advance(9)


def test_a_state_that_is_no_number_ends_the_run_and_is_named(system: System) -> None:
    """NaN must never leave the grid."""
    grid = Grid(system, method="rk4", steps_per_second=240)
    grid._x[system.labels.index("omega.G7")] = np.nan
    with pytest.raises(NumericalError, match=r"at t = 0\.0000 s"):
        grid.advance(1)
