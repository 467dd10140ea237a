"""The weights of an experiment reach both averages: the grid's own and the controllers'."""

from pathlib import Path

import numpy as np
import pytest

from scenarios.study import run
from tieline.grid.average import rotor_weights, sensor_weights
from tieline.grid.case import load_case
from tieline.resources import case_folder

SHORT = ("sweep=[]", "grid.duration=1.5 s", "federation.core=local", "network.engine=ideal")


@pytest.mark.parametrize("reporting", ["60", "continuous"])
def test_sensors_are_weighed_by_inertia_whoever_forms_the_average(
    reporting: str, tmp_path: Path
) -> None:
    """A weight that only one of two paths knows would make the ideal run another experiment."""
    settings = (*SHORT, f"wams.reporting={reporting}", "wams.weights=H_MVA", "grid.events=[]")
    disturbed = ("grid.events=[{at: 0.5 s, trip_branch: 60-61}]",)
    result = run("g26_trip", tmp_path / "out", *settings, *disturbed)
    case = load_case(case_folder("miniwecc"))
    weight = sensor_weights(case, case.base.sensors, "H_MVA")
    if reporting == "continuous":
        weight[case.base.sensors.index(61)] = 0.0
    grid = result.table("grid")
    f_hz = grid[[f"f_hz.B{bus}" for bus in case.base.sensors]].to_numpy()
    expected = f_hz @ weight / weight.sum() / 60.0
    believed = grid["wbar_pu.G1"].to_numpy()
    # The frames of the last instant find the network closed.
    after = (grid["t_s"].to_numpy() > 0.6) & (grid["t_s"].to_numpy() < 1.5)
    # The FREQ of a frame is a 32-bit float: 4e-6 Hz at 60 Hz, 6e-8 pu.
    tolerance = 1e-7 if reporting == "60" else 1e-12
    np.testing.assert_allclose(believed[after], expected[after], rtol=0, atol=tolerance)


def test_rotors_are_weighed_by_a_list_of_units(tmp_path: Path) -> None:
    """With rotors the list counts the units, not the sensors."""
    weights = [float(unit % 3) for unit in range(34)]
    settings = ("wams.reporting=continuous", "grid.pss.average=rotors", f"wams.weights={weights}")
    result = run("g26_trip", tmp_path / "out", *SHORT, *settings)
    case = load_case(case_folder("miniwecc"))
    weight = rotor_weights(case, weights)
    weight[case.units.index("G26")] = 0.0
    grid = result.table("grid")
    speed = grid[[f"speed_pu.{unit}" for unit in case.units]].to_numpy()
    expected = speed @ weight / weight.sum()
    after = grid["t_s"].to_numpy() > 1.0
    np.testing.assert_allclose(
        grid["wbar_pu.G1"].to_numpy()[after], expected[after], rtol=0, atol=1e-12
    )
