"""The average: by whom it is weighed, of what it is made, and who leaves it."""

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.grid.average import (
    continuous_average,
    inertia,
    rotor_weights,
    sensor_shares,
    sensor_weights,
    without_tripped,
)
from tieline.grid.case import Case
from tieline.grid.events import plan_events
from tieline.grid.powerflow import PowerFlow
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import build_system
from tieline.wams.settings import WamsSettings

WEIGHTS = ["equal", "H", "H_MVA"]


def grid_with(case: Case, flow: PowerFlow, of: str, weights: object, delay_steps: int = 0) -> Grid:
    """Return a grid whose average is made so, with the trip of G26 at the start."""
    wams = WamsSettings(weights=weights, reporting="continuous")
    average = continuous_average(case, case.base.sensors, wams, of, delay_steps)
    system = build_system(case, flow, case.base.sensors, average)
    settings = GridSettings(duration=10.0, events=[{"at": 0.0, "trip_generator": "G26"}])
    events = plan_events(case, settings)
    return Grid(system, method="rk4", steps_per_second=240, events=events)


def test_rotors_are_weighed_by_inertia_or_stored_energy(miniwecc: Case) -> None:
    """The centre of inertia is the average by H times rating; the paper's default is by none."""
    H = np.array([device.values["H"] for device in miniwecc.devices["machine"]])
    np.testing.assert_array_equal(inertia(miniwecc), H)
    np.testing.assert_array_equal(rotor_weights(miniwecc, "equal"), np.ones(34))
    np.testing.assert_array_equal(rotor_weights(miniwecc, "H"), H)
    np.testing.assert_array_equal(rotor_weights(miniwecc, "H_MVA"), H * miniwecc.unit_MVA)
    given = np.arange(34.0)
    np.testing.assert_array_equal(rotor_weights(miniwecc, given.tolist()), given)


def test_a_list_for_rotors_counts_the_units(miniwecc: Case) -> None:
    """Thirty weights are meant for sensors; with rotors they would leave four units out."""
    with pytest.raises(InputError, match=r"each of the 34 units, as grid\.pss\.average is"):
        rotor_weights(miniwecc, [1.0] * 30)


def test_a_sensor_carries_the_units_behind_its_step_up_branches(miniwecc: Case) -> None:
    """Bus 61 measures for G26 alone; a unit counts at one sensor at most."""
    sensors = miniwecc.base.sensors
    shares = sensor_shares(miniwecc, sensors, "H")
    g26 = miniwecc.units.index("G26")
    row = sensors.index(61)
    assert np.flatnonzero(shares[row]).tolist() == [g26]
    assert shares[row, g26] == inertia(miniwecc)[g26]
    assert ((shares > 0).sum(axis=0) <= 1).all()
    assert ((shares > 0).sum(axis=1) >= 1).all()


def test_units_at_one_sensor_add_up(miniwecc: Case) -> None:
    """A plant of two units speaks for both."""
    shares = sensor_shares(miniwecc, miniwecc.base.sensors, "H_MVA")
    shared = np.flatnonzero((shares > 0).sum(axis=1) > 1)
    assert shared.size
    weights = sensor_weights(miniwecc, miniwecc.base.sensors, "H_MVA")
    np.testing.assert_allclose(weights, shares.sum(axis=1), rtol=1e-15)
    assert weights.sum() <= rotor_weights(miniwecc, "H_MVA").sum() * (1 + 1e-12)


def test_a_sensor_without_a_unit_cannot_be_weighed_by_one(miniwecc: Case) -> None:
    """Weight 0 would switch a sensor off that somebody asked for."""
    with pytest.raises(InputError, match=r"wams\.weights: H weighs .* but bus 8 has none"):
        sensor_weights(miniwecc, [2, 8], "H")
    assert sensor_weights(miniwecc, [2, 8], "equal").tolist() == [1.0, 1.0]


@pytest.mark.parametrize("weights", [*WEIGHTS, [float(k % 5) for k in range(34)]], ids=str)
def test_a_tripped_unit_leaves_the_average_of_rotors(
    tuned: Case, flow: PowerFlow, weights: object
) -> None:
    """G26 runs away alone; its speed says nothing about the interconnection."""
    grid = grid_with(tuned, flow, "rotors", weights)
    grid.advance(480)
    weight = rotor_weights(tuned, weights)
    g26 = tuned.units.index("G26")
    weight[g26] = 0.0
    omega = grid.signal("omega")
    assert omega[g26] > 1.05
    expected = (weight * omega).sum() / weight.sum()
    assert grid.signal("wbar")[0] == pytest.approx(expected, abs=1e-14)


def test_by_stored_energy_the_average_of_rotors_is_the_centre_of_inertia(
    tuned: Case, flow: PowerFlow
) -> None:
    """Two independent routes to one number."""
    grid = grid_with(tuned, flow, "rotors", "H_MVA")
    grid.advance(240)
    assert grid.signal("wbar")[0] == pytest.approx(grid.centre_of_inertia(), abs=1e-15)


@pytest.mark.parametrize("weights", ["H", "H_MVA"])
def test_a_tripped_units_sensor_loses_its_weight(
    tuned: Case, flow: PowerFlow, weights: str
) -> None:
    """Inertia that is gone must not count, though the bus behind it still has a voltage."""
    grid = grid_with(tuned, flow, "sensors", weights)
    grid.advance(480)
    f_hz = grid.reading().f_hz
    weight = sensor_weights(tuned, tuned.base.sensors, weights)
    weight[tuned.base.sensors.index(61)] = 0.0
    expected = (weight * f_hz).sum() / weight.sum() / 60.0
    assert grid.signal("wbar")[0] == pytest.approx(expected, abs=1e-14)


def test_with_equal_weights_every_sensor_stays(tuned: Case, flow: PowerFlow) -> None:
    """A sensor measures a bus; the bus does not trip with the unit."""
    grid = grid_with(tuned, flow, "sensors", "equal")
    grid.advance(480)
    expected = grid.reading().f_hz.mean() / 60.0
    assert grid.signal("wbar")[0] == pytest.approx(expected, abs=1e-14)


def test_the_average_without_a_unit_is_scaled_to_one(miniwecc: Case) -> None:
    """Otherwise the average would jump by the share of whoever leaves."""
    wams = WamsSettings(weights="H")
    average = continuous_average(miniwecc, miniwecc.base.sensors, wams, "rotors", 0)
    is_in_service = np.ones(34, bool)
    same = without_tripped(average, is_in_service)
    np.testing.assert_allclose(same.weight, average.weight, rtol=1e-15)
    is_in_service[[3, 25]] = False
    rest = without_tripped(average, is_in_service)
    assert rest.weight.sum() == pytest.approx(1.0, abs=1e-15)
    assert rest.weight[3] == rest.weight[25] == 0.0
    np.testing.assert_allclose(
        rest.weight[:3] / rest.weight[0], average.weight[:3] / average.weight[0], rtol=1e-15
    )
