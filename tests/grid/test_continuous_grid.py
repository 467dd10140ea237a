"""The grid that forms and delays the average itself, at every step, as the reference did."""

from pathlib import Path

import numpy as np
import pytest

from grid.federate_runs import PSS, RATE_HZ, SENSORS, STEPS, TRIP, column, delivered, opened
from tieline.cosim.interfaces import FrameBundle
from tieline.grid.case import Case
from tieline.grid.devices import with_pss
from tieline.grid.events import plan_events
from tieline.grid.powerflow import PowerFlow
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import build_system, sensor_average
from tieline.tables import read_table
from tieline.units import tick_ns

DELAY_S, DELAY_STEPS = 0.025, 6


@pytest.fixture
def continuous(miniwecc: Case, tmp_path: Path) -> tuple[list[bytes], Path]:
    """What a grid that forms and delays the average itself sends, and its folder."""
    wams = {"reporting": "continuous"}
    grid = opened(miniwecc, tmp_path, {"events": [TRIP]}, wams, DELAY_S)
    sent = grid.start()
    sent += [grid.advance(k, delivered(k)) for k in range(6)]
    grid.finish()
    return sent, tmp_path


def test_continuous_reporting_sends_no_frames(continuous: tuple[list[bytes], Path]) -> None:
    """The federates still meet, so that both kinds of run keep one clock."""
    bundles = [FrameBundle.from_bytes(data) for data in continuous[0]]
    assert [bundle.measured_ns for bundle in bundles] == [tick_ns(k, RATE_HZ) for k in range(7)]
    assert all(bundle.payloads.size == 0 for bundle in bundles)


def test_continuous_reporting_is_the_bare_grid_to_the_last_bit(
    continuous: tuple[list[bytes], Path], miniwecc: Case, flow: PowerFlow
) -> None:
    """What is held against the reference must be what users run."""
    settings = GridSettings(duration=0.1, pss=PSS, events=[TRIP])
    case = with_pss(miniwecc, settings.pss)
    average = sensor_average(np.ones(SENSORS), DELAY_STEPS)
    system = build_system(case, flow, case.base.sensors, average)
    events = plan_events(case, settings)
    grid = Grid(system, method="rk4", steps_per_second=STEPS, events=events)
    table = read_table(continuous[1] / "grid.parquet")
    names = (("omega", "speed_pu"), ("vt", "vt_pu"), ("v_s", "vs_pu"), ("wbar", "wbar_pu"))
    for row in range(7):
        grid.advance(4 * row)
        for signal, quantity in names:
            recorded = table.loc[row, [f"{quantity}.{unit}" for unit in case.units]]
            np.testing.assert_array_equal(recorded.to_numpy(np.float64), grid.signal(signal))
    assert table["wbar_pu.G1"].iloc[-1] < 1.0


def test_the_age_of_a_continuous_average_is_its_delay(
    continuous: tuple[list[bytes], Path],
) -> None:
    """Before the first value is through, what is held is as old as the run."""
    expected = [min(k / RATE_HZ, DELAY_S) for k in range(7)]
    # Instants are whole nanoseconds.
    np.testing.assert_allclose(column(continuous[1], "age_s.G1"), expected, rtol=0, atol=1e-9)
