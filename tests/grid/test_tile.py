"""Copies of a case side by side, joined by ties that carry nothing at the start."""

import numpy as np

from tieline.grid.case import Case
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import PssSettings
from tieline.grid.stabilisers import with_pss
from tieline.grid.system import build_system
from tieline.grid.tile import tiled

TIMES = 3


def test_each_tile_has_the_power_flow_of_the_case_alone(miniwecc: Case, flow: PowerFlow) -> None:
    """Otherwise what grows with the size would not be the size alone."""
    found = solve_power_flow(tiled(miniwecc, TIMES))
    count = len(miniwecc.buses.number)
    for tile in range(TIMES):
        own = slice(tile * count, (tile + 1) * count)
        np.testing.assert_allclose(found.v[own], flow.v, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.theta[own], flow.theta, rtol=0, atol=1e-9)


def test_a_tiled_case_is_at_rest_and_has_the_modes_of_several(miniwecc: Case) -> None:
    """Names and states must come once for each tile."""
    case = with_pss(tiled(miniwecc, TIMES), PssSettings(gain=9.0, beta1=1.0, beta2=0.5))
    assert len(set(case.units)) == TIMES * len(miniwecc.units)
    assert len(set(case.buses.number.tolist())) == TIMES * len(miniwecc.buses.number)
    # Refuses a system that is not at rest.
    system = build_system(case, solve_power_flow(case), case.base.sensors)
    assert len(system.plan.unit_bus) == len(case.units)


def test_one_tile_is_the_case(miniwecc: Case) -> None:
    """The smallest number of tiles changes nothing but names."""
    one = tiled(miniwecc, 1)
    np.testing.assert_array_equal(one.branches.impedance, miniwecc.branches.impedance)
    np.testing.assert_array_equal(one.loads.bus, miniwecc.loads.bus)
