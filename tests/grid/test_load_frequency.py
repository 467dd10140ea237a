"""Loads that answer to the frequency of their own bus."""

from pathlib import Path

import numpy as np
import pytest

from grid.runs import G26_AT_100_MS, disturbed, speeds
from grid.spoiled import copied, findings_of
from tieline.grid.case import Case, load_case
from tieline.grid.load_mix import with_load_mix
from tieline.grid.powerflow import PowerFlow
from tieline.grid.settings import GridSettings, LoadSettings
from tieline.grid.simulation import Grid
from tieline.grid.stabilisers import with_pss
from tieline.grid.system import System, build_system

ANSWER = 2.0


def system_of(case: Case, flow: PowerFlow, answer: float, q_answer: float = 0.0) -> System:
    """The miniWECC with loads of constant current that answer to frequency."""
    mix = LoadSettings(p_constant_current=1.0, p_frequency=answer, q_frequency=q_answer)
    fitted = with_pss(with_load_mix(case, mix), GridSettings().pss)
    return build_system(fitted, flow, fitted.base.sensors)


def settled(system: System) -> float:
    """Return the mean deviation of the COI from 50 to 60 s after the loss of G26, pu."""
    grid = disturbed(system, "trapezoid", 60, G26_AT_100_MS)
    deviations = []
    for tick in range(50 * 60, 60 * 60, 6):
        grid.advance(tick)
        deviations.append(grid.centre_of_inertia() - 1.0)
    return float(np.mean(deviations))


def test_loads_share_a_deficit_with_the_governors(miniwecc: Case, flow: PowerFlow) -> None:
    """A lost power L moves the frequency by L / (sum of 1/R + k P of the loads)."""
    without, answering = (system_of(miniwecc, flow, answer) for answer in (0.0, ANSWER))
    free, held = settled(without), settled(answering)
    lost = float(miniwecc.buses.p_gen[miniwecc.unit_bus[miniwecc.units.index("G26")]])
    plain = ~miniwecc.loads.is_hvdc
    load = float(miniwecc.buses.p_load[miniwecc.loads.bus[plain]].sum())
    expected = lost / (lost / abs(free) + ANSWER * load)
    # Losses, and the voltages that loads of constant current follow, change a little, too.
    assert abs(held) == pytest.approx(expected, rel=0.03)
    assert abs(held) < 0.9 * abs(free)


def test_every_answering_load_has_a_filter_of_its_own(miniwecc: Case, flow: PowerFlow) -> None:
    """Otherwise a load would follow the frequency of another place."""
    system = system_of(miniwecc, flow, ANSWER)
    loads, sensors = system.plan.loads, system.plan.sensors
    seen = loads.filter >= 0
    assert np.array_equal(sensors.bus[loads.filter[seen]], loads.bus[seen])
    assert seen.sum() == len(miniwecc.loads.bus) - miniwecc.loads.is_hvdc.sum()
    assert sensors.pmus == len(miniwecc.base.sensors)
    assert "z2.load.B8" in system.labels
    grid = Grid(system, method="rk4", steps_per_second=240)
    assert len(grid.reading().f_hz) == sensors.pmus


def test_the_implicit_method_sees_the_same_loads(miniwecc: Case, flow: PowerFlow) -> None:
    """Otherwise a study would depend on the method of integration."""
    system = system_of(miniwecc, flow, ANSWER, q_answer=-1.0)
    ends = []
    for method, rate in (("rk4", 960), ("trapezoid", 240)):
        grid = disturbed(system, method, rate, G26_AT_100_MS)
        grid.advance(3 * rate)
        ends.append(speeds(grid))
    # The trapezoid's own error at 1/240 s is below 2e-7 pu with loads that see no frequency.
    assert np.abs(ends[0] - ends[1]).max() < 5e-7


def test_a_table_may_say_how_each_load_answers(tmp_path: Path) -> None:
    """Measured loads differ from bus to bus."""
    folder = copied(tmp_path)
    table = folder / "load.csv"
    header, *rows = [row.split(",") for row in table.read_text().splitlines()]
    header.insert(5, "p_frequency")
    for row in rows:
        row.insert(5, "1.5" if row[0] == "8" else "")
    table.write_text("\n".join(",".join(row) for row in (header, *rows)) + "\n")
    loads = load_case(folder).loads
    assert loads.p_frequency[0] == 1.5
    assert not loads.p_frequency[1:].any()
    assert not loads.q_frequency.any()
    rows[0][5] = "25"
    next(row for row in rows if row[6] == "hvdc")[5] = "1"
    table.write_text("\n".join(",".join(row) for row in (header, *rows)) + "\n")
    found = "\n".join(findings_of(folder))
    assert "load.csv:2: 'p_frequency' must lie between -20 and 20 pu/pu (got 25)" in found
    assert "'p_frequency' must be 0 for an HVDC terminal (got 1)" in found
