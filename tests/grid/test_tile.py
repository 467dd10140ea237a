"""Copies of a case side by side, joined by ties that carry nothing at the start."""

from dataclasses import replace

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import PssSettings
from tieline.grid.stabilisers import with_pss
from tieline.grid.system import build_system
from tieline.grid.tile import TIE_KIND, tiled

TIMES = 3


def test_each_tile_has_the_power_flow_of_the_case_alone(miniwecc: Case, flow: PowerFlow) -> None:
    """Otherwise what grows with the size would not be the size alone."""
    case, own_start = tiled(miniwecc, TIMES), miniwecc.buses
    start = {"v": np.tile(own_start.v, TIMES), "theta": np.tile(own_start.theta, TIMES)}
    # From where the case starts: not from the solution that the tiles bring along.
    found = solve_power_flow(replace(case, buses=replace(case.buses, **start)))
    assert found.iterations > 0
    count = len(miniwecc.buses.number)
    for tile in range(TIMES):
        own = slice(tile * count, (tile + 1) * count)
        np.testing.assert_allclose(found.v[own], flow.v, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.theta[own], flow.theta, rtol=0, atol=1e-9)


def test_a_tiled_case_is_at_rest_with_every_name_once(miniwecc: Case) -> None:
    """Names and states must come once for each tile."""
    case = with_pss(tiled(miniwecc, TIMES), PssSettings(gain=9.0, beta1=1.0, beta2=0.5))
    assert len(set(case.units)) == TIMES * len(miniwecc.units)
    assert len(set(case.buses.number.tolist())) == TIMES * len(miniwecc.buses.number)
    # Refuses a system that is not at rest.
    system = build_system(case, solve_power_flow(case), case.base.sensors)
    assert len(system.plan.unit_bus) == len(case.units)


def test_ties_carry_nothing_and_one_slack_bus_is_left(miniwecc: Case) -> None:
    """Power over a tie would move the operating point of every tile."""
    case = tiled(miniwecc, TIMES)
    v, ties = solve_power_flow(case).phasor, np.array(case.branches.kind) == TIE_KIND
    assert ties.sum() == (TIMES - 1) * len(miniwecc.base.areas)
    difference = v[case.branches.start[ties]] - v[case.branches.end[ties]]
    # Equal to rounding: 1e-12 pu over the reactance is 5e-11 pu of power.
    assert np.abs(difference).max() < 1e-12
    assert case.buses.kind.count("slack") == 1


def test_no_tile_at_all_is_refused(miniwecc: Case) -> None:
    """An empty case would fail far from here."""
    with pytest.raises(InputError, match=r"at least once \(got 0\)"):
        tiled(miniwecc, 0)


def test_one_tile_is_the_case(miniwecc: Case) -> None:
    """The smallest number of tiles changes nothing but names."""
    one = tiled(miniwecc, 1)
    np.testing.assert_array_equal(one.branches.impedance, miniwecc.branches.impedance)
    np.testing.assert_array_equal(one.loads.bus, miniwecc.loads.bus)
