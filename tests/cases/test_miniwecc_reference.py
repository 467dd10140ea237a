"""miniWECC against PSTess 1.1; `cases/miniwecc/expected/README.md` explains each tolerance."""

import csv
from pathlib import Path

import numpy as np
import pytest

from grid.quirk import PSTessST3
from tieline.grid.case import Case, load_case
from tieline.grid.devices import with_pss
from tieline.grid.events import plan_events
from tieline.grid.models.exciters.st3_potential import ST3Potential
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import GridSettings, PssSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import build_system, rotor_average, sensor_average
from tieline.resources import case_folder
from tieline.tables import read_table

EXPECTED = case_folder("miniwecc") / "expected"
RATE = 480
SPEED_PU, VOLTAGE_PU, END_PU = 3e-5, 3e-4, 1e-8


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case(case_folder("miniwecc"))


@pytest.fixture(scope="module")
def flow(case: Case) -> PowerFlow:
    return solve_power_flow(case)


def test_the_power_flow_is_the_references_at_every_bus(case: Case, flow: PowerFlow) -> None:
    """Every trajectory starts here."""
    expected = rows(EXPECTED / "powerflow.csv")
    assert [int(row["bus"]) for row in expected] == case.buses.number.tolist()
    v = np.array([float(row["v_pu"]) for row in expected])
    theta = np.array([float(row["theta_deg"]) for row in expected])
    np.testing.assert_allclose(flow.v, v, rtol=0, atol=1e-7)
    np.testing.assert_allclose(np.rad2deg(flow.theta), theta, rtol=0, atol=1e-5)


def trip(case: Case, flow: PowerFlow, run: dict[str, str], substitute: dict) -> Grid:
    """The G26 trip as the reference ran it: Heun at 1/480 s, a pure delay of the average."""
    pss = PssSettings(
        model=run["pss"],
        gain=float(run["K_pu"]),
        beta1=float(run["beta1"]),
        beta2=float(run["beta2"]),
    )
    settings = GridSettings(
        method="heun",
        steps_per_second=RATE,
        pss=pss,
        events=[{"at": 1.0, "trip_generator": "G26"}],
    )
    case = with_pss(case, pss)
    delay_steps = round(float(run["delay_s"]) * RATE)
    if run["average"] == "sensors":
        average = sensor_average(np.ones(30), delay_steps)
    else:
        average = rotor_average(np.ones(34), delay_steps)
    system = build_system(case, flow, case.base.sensors, average, substitute)
    events = plan_events(case, settings)
    return Grid(system, method="heun", steps_per_second=RATE, events=events)


def differences(grid: Grid, run: str) -> tuple[np.ndarray, np.ndarray]:
    """Return (instants, units without G26) differences in speed and terminal voltage."""
    table = read_table(EXPECTED / "g26_trip" / f"{run}.parquet")
    units = [unit for unit in grid.system.case.units if unit != "G26"]
    keep = [grid.system.case.units.index(unit) for unit in units]
    speed = table[[f"speed_pu.{unit}" for unit in units]].to_numpy()
    voltage = table[[f"vt_pu.{unit}" for unit in units]].to_numpy()
    d_speed, d_voltage = [], []
    for row, t_s in enumerate(table["t_s"]):
        grid.advance(round(t_s * RATE))
        d_speed.append(grid.signal("omega")[keep] - speed[row])
        d_voltage.append(grid.signal("vt")[keep] - voltage[row])
    return np.abs(d_speed), np.abs(d_voltage)


RUNS = rows(EXPECTED / "g26_trip" / "runs.csv")
every_run = pytest.mark.parametrize("run", RUNS, ids=lambda run: run["run"])


@every_run
def test_the_trip_of_g26_is_the_references(case: Case, flow: PowerFlow, run: dict) -> None:
    """Both tunings, ideal and under every pure delay: the numbers that the paper rests on."""
    d_speed, d_voltage = differences(trip(case, flow, run, {}), run["run"])
    assert d_speed.max() < SPEED_PU
    assert d_voltage.max() < VOLTAGE_PU


@every_run
def test_with_the_references_exciter_the_trip_ends_on_its_digits(
    case: Case, flow: PowerFlow, run: dict
) -> None:
    """With the one known difference taken away, nothing may be left but rounding."""
    d_speed, d_voltage = differences(trip(case, flow, run, {ST3Potential: PSTessST3}), run["run"])
    assert d_speed[-1].max() < END_PU
    assert d_speed.max() < SPEED_PU
    assert d_voltage.max() < VOLTAGE_PU
