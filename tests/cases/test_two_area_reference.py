"""The two-area system against PSTess 1.1; `expected/README.md` of each case explains the bounds."""

import csv
from pathlib import Path

import numpy as np
import pytest

from tieline.grid.case import Case, load_case
from tieline.grid.devices import with_pss
from tieline.grid.events import plan_events
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import GridSettings, PssSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import build_system, rotor_average
from tieline.resources import case_folder
from tieline.tables import read_table

RATE = 480
CASES = ("two_area", "two_area_original")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def expected(name: str) -> Path:
    return case_folder(name) / "expected"


@pytest.fixture(scope="module")
def cases() -> dict[str, tuple[Case, PowerFlow]]:
    loaded = {name: load_case(case_folder(name)) for name in CASES}
    return {name: (case, solve_power_flow(case)) for name, case in loaded.items()}


@pytest.mark.parametrize("name", CASES)
def test_the_power_flow_is_the_references(
    cases: dict[str, tuple[Case, PowerFlow]], name: str
) -> None:
    """Every trajectory starts here."""
    case, flow = cases[name]
    table = rows(expected(name) / "powerflow.csv")
    assert [int(row["bus"]) for row in table] == case.buses.number.tolist()
    np.testing.assert_allclose(flow.v, [float(row["v_pu"]) for row in table], rtol=0, atol=1e-7)
    theta = [float(row["theta_deg"]) for row in table]
    np.testing.assert_allclose(np.rad2deg(flow.theta), theta, rtol=0, atol=1e-5)


def trip(case: Case, flow: PowerFlow, beta1: float, beta2: float) -> Grid:
    pss = PssSettings(model="generalized", gain=18.0, beta1=beta1, beta2=beta2)
    settings = GridSettings(
        duration=21.0,
        method="heun",
        steps_per_second=RATE,
        events=[{"at": 1.0, "trip_generator": "G3"}],
    )
    fitted = with_pss(case, pss)
    system = build_system(fitted, flow, case.base.sensors, rotor_average(np.ones(4)))
    events = plan_events(fitted, settings)
    return Grid(system, method="heun", steps_per_second=RATE, events=events)


RUNS = [(name, row) for name in CASES for row in rows(expected(name) / "g3_trip" / "runs.csv")]


@pytest.mark.parametrize(("name", "run"), RUNS, ids=lambda item: item if item in CASES else "")
def test_the_trip_of_g3_is_the_references(
    cases: dict[str, tuple[Case, PowerFlow]], name: str, run: dict[str, str]
) -> None:
    """The paper's first system, with every tuning that the reference has."""
    grid = trip(*cases[name], float(run["beta1"]), float(run["beta2"]))
    table = read_table(expected(name) / "g3_trip" / f"{run['run']}.parquet")
    keep = [0, 1, 3]
    speed = table[[f"speed_pu.G{i + 1}" for i in keep]].to_numpy()
    voltage = table[[f"vt_pu.G{i + 1}" for i in keep]].to_numpy()
    d_speed, d_voltage = [], []
    for row, t_s in enumerate(table["t_s"]):
        grid.advance(round(t_s * RATE))
        d_speed.append(np.abs(grid.signal("omega")[keep] - speed[row]).max())
        d_voltage.append(np.abs(grid.signal("vt")[keep] - voltage[row]).max())
    assert max(d_speed) < 3e-5
    assert max(d_voltage) < 3e-4


def response(
    cases: dict[str, tuple[Case, PowerFlow]], beta1: float, beta2: float
) -> tuple[float, np.ndarray]:
    """Return the nadir of the centre of inertia, Hz, and the voltage of G4 over time."""
    grid = trip(*cases["two_area"], beta1, beta2)
    coi, voltage = [], []
    for tick in range(0, 15 * RATE + 1, RATE // 20):
        grid.advance(tick)
        coi.append(60.0 * grid.centre_of_inertia())
        voltage.append(grid.signal("vt")[3])
    return min(coi), np.array(voltage)


def test_beta2_lifts_the_nadir_first_much_then_little_and_lowers_the_voltage(
    cases: dict[str, tuple[Case, PowerFlow]],
) -> None:
    """The paper: significantly from 0 to 0.33, modestly from 0.33 to 0.67; voltage of G4 falls."""
    runs = [response(cases, 0.33, beta2) for beta2 in (0.0, 0.33, 0.67)]
    nadirs = [nadir for nadir, _ in runs]
    # The reference's nadirs: 59.580, 59.754 and 59.831 Hz.
    np.testing.assert_allclose(nadirs, [59.580, 59.754, 59.831], atol=0.003)
    assert nadirs[1] - nadirs[0] > 2 * (nadirs[2] - nadirs[1]) > 0
    lowest = [voltage.min() for _, voltage in runs]
    assert lowest[0] > lowest[1] > lowest[2]


def test_beta1_leaves_the_large_signal_voltage_alone(
    cases: dict[str, tuple[Case, PowerFlow]],
) -> None:
    """The paper: beta1 acts on swings, not on the common motion that moves the voltage of G4."""
    # The mean over a period of the swing (0.76 Hz, 26 samples) is what is left without swings.
    period = np.ones(26) / 26

    def slow(beta1: float, beta2: float) -> np.ndarray:
        return np.convolve(response(cases, beta1, beta2)[1], period, mode="valid")

    by_beta1 = [np.abs(slow(beta1, 0.33) - slow(0.33, 0.33)).max() for beta1 in (0.67, 1.0)]
    by_beta2 = np.abs(slow(0.33, 0.67) - slow(0.33, 0.0)).max()
    assert max(by_beta1) < 0.1 * by_beta2
