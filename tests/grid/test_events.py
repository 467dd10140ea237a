"""Disturbances: what they do to network, set-points and units, and when."""

from typing import Any

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.events import plan_events
from tieline.grid.powerflow import PowerFlow
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import System, build_system, rotor_average

RATE = 480


def grid_with(system: System, *events: dict[str, Any], method: str = "heun") -> Grid:
    """Return a grid with events given as an experiment file gives them."""
    settings = GridSettings(duration=60.0, steps_per_second=RATE, method=method, events=events)
    planned = plan_events(system.case, settings)
    return Grid(system, method=method, steps_per_second=RATE, events=planned)


def voltage(grid: Grid, bus: int) -> float:
    return float(abs(grid.voltages()[grid.system.case.bus_index(bus)]))


FAULT = {
    "at": "0.1 s",
    "fault_bus": 86,
    "clear_after": "95.8333 ms",
    "trip": "86-87",
    "far_clear_after": "100 ms",
}


def test_a_fault_is_cleared_at_its_two_ends_step_by_step(system: System) -> None:
    """46 and 48 steps of 1/480 s: a step more or less moves every later curve."""
    grid = grid_with(system, FAULT)
    seen = {}
    for tick in (47, 48, 48 + 45, 48 + 46, 48 + 47, 48 + 48):
        grid.advance(tick)
        seen[tick] = (voltage(grid, 86), voltage(grid, 87))
    assert seen[47][0] > 0.95
    # A susceptance of 1e7 pu leaves some 1e-5 pu of voltage.
    assert seen[48][0] < 1e-4
    assert seen[48 + 45][0] < 1e-4
    # The near end is open: bus 86 recovers, bus 87 still feeds the fault through the line.
    assert seen[48 + 46][0] > 0.6
    assert seen[48 + 46][1] < seen[48 + 46][0]
    assert seen[48 + 48][1] > seen[48 + 47][1] + 0.05


def test_the_far_end_feeds_the_fault_through_the_branch(system: System) -> None:
    """Between the two openings the network is that with a new bus at the fault, as in PSTess."""
    grid = grid_with(system, FAULT)
    grid.advance(48 + 46)
    ((bus, shunt),) = grid._network.shunts.values()
    assert system.case.buses.number[bus] == 87
    row = system.case.branches.name.index("86-87")
    z = system.case.branches.impedance[row]
    assert shunt == pytest.approx(1.0 / (z + 1.0 / -1e7j), rel=1e-12)


def test_a_fault_that_goes_out_by_itself_leaves_the_network_as_it_was(system: System) -> None:
    """What an event has switched on it must switch off again."""
    grid = grid_with(system, {"at": 0.1, "fault_bus": 63, "clear_after": "50 ms"})
    grid.advance(48 + 24)
    assert not grid._network.shunts
    for name in ("u_value", "l_value", "u_reciprocal"):
        got, whole = getattr(grid._plan.factors, name), getattr(system.plan.factors, name)
        np.testing.assert_array_equal(got, whole)


def test_a_brake_takes_its_power_and_goes_off(system: System) -> None:
    """1.4 GW at bus 18 for half a second, as the Chief Joseph brake."""
    grid = grid_with(system, {"at": 0, "brake_bus": 18, "size_MW": 1400.0, "duration": 0.5})
    ((_, shunt),) = grid._network.shunts.values()
    assert shunt == 14.0
    rise = (
        grid.signal("Pe") * system.case.unit_MVA / 100.0 - system.flow.p_gen[system.case.unit_bus]
    )
    # Constant-current loads elsewhere draw a little less as voltages fall.
    assert 10.0 < rise.sum() < 14.0 * voltage(grid, 18) ** 2 + 0.1
    grid.advance(RATE // 2)
    assert not grid._network.shunts
    assert [text for _, text in grid.log] == ["brake at bus 18 on", "brake at bus 18 off"]


def test_a_branch_that_recloses_restores_the_network(system: System) -> None:
    """A reclosed line carries power again."""
    event = {"at": 0.1, "trip_branch": "7-10", "reclose_after": "0.5 s"}
    grid = grid_with(system, event)
    row = system.case.branches.name.index("7-10")
    grid.advance(60)
    assert grid._network.is_open == {row}
    grid.advance(48 + 240)
    assert not grid._network.is_open
    np.testing.assert_array_equal(grid._plan.factors.u_value, system.plan.factors.u_value)


def test_a_unit_that_is_reconnected_counts_again(tuned: Case, flow: PowerFlow) -> None:
    """It left the averages with its branch, and comes back with it."""
    average = rotor_average(np.ones(34))
    system = build_system(tuned, flow, tuned.base.sensors, average)
    event = {"at": 0.1, "trip_branch": "60-61", "reclose_after": "50 ms"}
    grid = grid_with(system, event)
    g26 = tuned.units.index("G26")
    grid.advance(60)
    assert not grid.in_service[g26]
    assert grid._plan.average.weight[g26] == 0.0
    grid.advance(100)
    assert grid.in_service.all()
    np.testing.assert_allclose(grid._plan.average.weight, 1 / 34, rtol=1e-14)


def test_shedding_a_load_takes_its_current_away(system: System) -> None:
    """A shed load must not go on drawing through the network's own admittance."""
    grid = grid_with(system, {"at": 0, "scale_load": [8, 11], "factor": 0.0})
    row = system.case.bus_index(8)
    y = grid.system.after(grid._network)
    np.testing.assert_array_equal(y.factors.u_value, grid._plan.factors.u_value)
    at = system.plan.loads.bus.tolist().index(row)
    assert grid._plan.loads.p0[at] == 0.0
    assert grid._plan.loads.admittance[at] == 0.0
    grid.advance(2 * RATE)
    # 98 pu of some 1,000 pu of load are gone: frequency rises.
    assert grid.centre_of_inertia() > 1.0005


def test_load_up_is_frequency_down_and_the_other_way_round(system: System) -> None:
    """The sign of a step is the first thing that a reader checks."""
    speeds = []
    for factor in (0.98, 1.02):
        grid = grid_with(system, {"at": 0, "scale_load": "all", "factor": factor})
        grid.advance(RATE)
        speeds.append(grid.centre_of_inertia())
    assert speeds[0] > 1.0 > speeds[1]
    # Small steps act alike both ways; a percent of two percent is left.
    assert speeds[0] - 1.0 == pytest.approx(1.0 - speeds[1], rel=0.05)


def test_a_step_of_a_reference_moves_what_it_refers_to(system: System) -> None:
    """An exciter's reference lifts the voltage, a governor's the power of its own unit alone."""
    events = [
        {"at": 0, "step_reference": "G3", "Vref": 0.01},
        {"at": 0, "step_reference": "G14", "Pref": 0.05},
    ]
    grid = grid_with(system, *events)
    start = {name: grid.signal(name) for name in ("vt", "Pm")}
    grid.advance(5 * RATE)
    moved = {name: grid.signal(name) - start[name] for name in start}
    case = system.case
    assert moved["vt"][case.units.index("G3")] > 0.004
    assert moved["Pm"][case.units.index("G14")] > 0.01
    assert np.argmax(moved["vt"]) == case.units.index("G3")
    assert np.argmax(moved["Pm"]) == case.units.index("G14")


def test_a_blocked_governor_holds_its_power(system: System) -> None:
    """What is blocked must not answer to frequency, and the others must."""
    trip = {"at": 0.1, "trip_generator": "G26"}
    block = {"at": 0, "block_governor": ["G1", "G21"]}
    grid = grid_with(system, block, trip)
    start = grid.signal("Pm")
    grid.advance(4 * RATE)
    change = grid.signal("Pm") - start
    case = system.case
    assert change[case.units.index("G1")] == 0.0
    assert change[case.units.index("G21")] == 0.0
    assert change[case.units.index("G2")] > 1e-3


def test_an_hvdc_terminal_takes_the_power_that_it_is_ordered_to(system: System) -> None:
    """The Pacific DC Intertie's order moves at both ends, with opposite signs."""
    events = [
        {"at": 0, "modulate_hvdc": 24, "power_MW": -100.0},
        {"at": 0, "modulate_hvdc": 49, "power_MW": 100.0},
    ]
    grid = grid_with(system, *events)
    loads = grid._plan.loads
    numbers = system.case.buses.number[loads.bus].tolist()
    assert loads.p0[numbers.index(24)] == pytest.approx(28.5 - 1.0)
    assert loads.p0[numbers.index(49)] == pytest.approx(-28.5 + 1.0)


def test_a_condition_starts_its_event_once_when_it_has_held_long_enough(system: System) -> None:
    """Under-frequency load shedding: below 59.9 Hz for 0.2 s, and not a step earlier."""
    shed = {
        "at": 0,
        "when": "f_hz.B63 < 59.9 for 0.2 s",
        "scale_load": 64,
        "factor": 0.5,
    }
    grid = grid_with(system, {"at": 0.1, "trip_generator": "G26"}, shed)
    below = None
    for tick in range(1, 5 * RATE):
        grid.advance(tick)
        sensor = system.case.base.sensors.index(63)
        is_below = grid.reading().f_hz[sensor] < 59.9
        below = (tick if below is None else below) if is_below else None
        if len(grid.log) > 1:
            break
    assert below is not None
    assert grid.log[1] == (below + 96, "load at bus 64 times 0.5")
    grid.advance(6 * RATE)
    assert len(grid.log) == 2


def test_an_island_without_a_unit_is_dead_and_said_so(system: System) -> None:
    """Bus 8 hangs on one transformer; without it its load has nothing to draw from."""
    grid = grid_with(system, {"at": 0.1, "trip_branch": "8-7"})
    grid.advance(60)
    assert voltage(grid, 8) == 0.0
    assert voltage(grid, 7) > 0.9
    assert (48, "buses [8] are without a unit, and dead") in grid.log
    grid.advance(RATE)
    assert grid.centre_of_inertia() > 1.0


def test_a_sensor_on_a_dead_bus_says_that_its_data_are_no_good(
    tuned: Case, flow: PowerFlow
) -> None:
    """A controller must not average what nobody measures."""
    system = build_system(tuned, flow, (8, 10))
    grid = grid_with(system, {"at": 0.1, "trip_branch": "8-7"})
    grid.advance(RATE)
    reading = grid.reading()
    assert reading.is_live.tolist() == [False, True]
    assert reading.f_hz[0] == pytest.approx(60.0, abs=1e-3)


def test_two_islands_each_keep_their_own_frequency(system: System) -> None:
    """Alberta on its own speeds up or slows down apart from the rest."""
    opened = [{"at": 0.1, "trip_branch": "6-106"}]
    grid = grid_with(system, *opened)
    grid.advance(3 * RATE)
    g34 = system.case.units.index("G34")
    assert not grid.in_service[g34]
    assert grid.in_service.sum() == 33
    assert grid.is_live.all()
    assert abs(grid.signal("omega")[g34] - grid.centre_of_inertia()) > 1e-4


def test_a_run_that_loses_synchronism_ends_as_a_result(system: System) -> None:
    """A fault that stays for half a second is not a crash of the program."""
    grid = grid_with(system, {"at": 0.1, "fault_bus": 119, "clear_after": "600 ms"})
    grid.advance(20 * RATE)
    assert grid.ending is not None
    assert grid.ending.text.startswith(("unstable: ", "voltage collapse: "))
    assert grid.tick < 20 * RATE
    assert grid.log[-1] == (grid.ending.tick, grid.ending.text)
    tick = grid.tick
    grid.advance(30 * RATE)
    assert grid.tick == tick


@pytest.mark.parametrize(
    ("event", "text"),
    [
        ({"at": 1, "fault_bus": 860, "clear_after": 0.1}, "fault_bus: no bus 860"),
        ({"at": 1, "fault_bus": 86, "clear_after": 0.1, "trip": "24-20"}, "does not end at bus 86"),
        (
            {"at": 1, "fault_bus": 86, "clear_after": 0.1, "far_clear_after": 0.2},
            "far_clear_after: needs `trip`",
        ),
        (
            {**FAULT, "far_clear_after": "50 ms"},
            "far_clear_after: must be after clear_after",
        ),
        ({"at": 1, "close_branch": "7-10"}, "branch 7-10 is closed already"),
        ({"at": 1, "scale_load": 7, "factor": 0.5}, "scale_load: bus 7 has no load"),
        ({"at": 1, "step_reference": "G3"}, "needs Vref or Pref"),
        ({"at": 1, "step_reference": "G4", "Pref": 0.1}, "'G4' has no governor"),
        ({"at": 1, "block_governor": "G4"}, "block_governor: no governor of 'G4'"),
        ({"at": 1, "modulate_hvdc": 7, "power_MW": 5.0}, "has no constant-current terminal"),
        ({"at": 0, "when": "f_hz.B62 < 59", "scale_load": 8, "factor": 0.0}, "no PMU at bus 'B62'"),
        ({"at": 0, "when": "v_pu.B8 <", "scale_load": 8, "factor": 0.0}, "must read like"),
        ({"at": 0, "when": "speed_pu.G99 < 1", "scale_load": 8, "factor": 0.0}, "no unit 'G99'"),
        ({"at": 0, "when": "sped_pu.G9 < 1", "block_governor": "all"}, "no quantity 'sped_pu'"),
    ],
)  # fmt: skip
def test_an_event_that_cannot_happen_is_refused(
    miniwecc: Case, event: dict[str, Any], text: str
) -> None:
    """Before any process starts, with the setting's name and what is allowed."""
    settings = GridSettings(duration=60.0, steps_per_second=RATE, events=[event])
    with pytest.raises(InputError) as caught:
        plan_events(miniwecc, settings)
    assert any("grid.events[0]" in finding and text in finding for finding in caught.value.findings)
