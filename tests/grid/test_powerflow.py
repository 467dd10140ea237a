"""The power flow against its defining equations."""

from dataclasses import replace

import numpy as np
import pytest

from tieline.errors import NumericalError
from tieline.grid.case import Branches, Buses, Case, Loads
from tieline.grid.powerflow import PowerFlow, solve_power_flow


def injections(case: Case, flow: PowerFlow) -> np.ndarray:
    """Sum every branch's pi-section flow at its two ends, without an admittance matrix."""
    v, branches = flow.phasor, case.branches
    total = v * ((case.buses.g_shunt + 1j * case.buses.b_shunt) * v).conj()
    for row in range(len(branches.start)):
        i, j, tap = branches.start[row], branches.end[row], branches.tap[row]
        half = 0.5j * branches.susceptance[row]
        inner = v[i] / tap
        through = (inner - v[j]) / branches.impedance[row]
        total[i] += inner * (through + half * inner).conj()
        total[j] += v[j] * (-through + half * v[j]).conj()
    return total


def test_every_bus_injects_what_the_schedule_says(miniwecc: Case, flow: PowerFlow) -> None:
    """A wrong admittance matrix would put every later result on a wrong operating point."""
    surplus = injections(miniwecc, flow) + miniwecc.buses.p_load + 1j * miniwecc.buses.q_load
    kinds = np.array(miniwecc.buses.kind)
    # Sums of some ten terms of size 100 in double precision.
    assert np.abs(surplus.real - miniwecc.buses.p_gen)[kinds != "slack"].max() < 1e-10
    assert np.abs(surplus.imag)[kinds == "pq"].max() < 1e-10


def renumbered(case: Case, order: np.ndarray) -> Case:
    """Return the case with its buses in another order."""
    place = np.argsort(order)
    buses = {
        name: tuple(np.array(value)[order]) if isinstance(value, tuple) else value[order]
        for name, value in vars(case.buses).items()
    }
    branches = {**vars(case.branches), "start": place[case.branches.start]}
    branches["end"] = place[case.branches.end]
    loads = {**vars(case.loads), "bus": place[case.loads.bus]}
    return replace(
        case,
        buses=Buses(**buses),
        branches=Branches(**branches),
        loads=Loads(**loads),
        unit_bus=place[case.unit_bus],
    )


def test_the_order_of_the_buses_does_not_matter(miniwecc: Case, flow: PowerFlow) -> None:
    """A result that depended on row order would hide an indexing mistake."""
    order = np.random.default_rng(3).permutation(len(miniwecc.buses.number))
    other = solve_power_flow(renumbered(miniwecc, order))
    # Both end below a mismatch of 1e-10 pu; sensitivities of voltages to it are of order 1.
    np.testing.assert_allclose(other.phasor, flow.phasor[order], rtol=0, atol=1e-9)


def test_a_load_beyond_what_the_network_carries_is_an_error_that_names_a_bus(
    miniwecc: Case,
) -> None:
    """A diverged power flow must never be taken for an operating point."""
    heavy = replace(miniwecc, buses=replace(miniwecc.buses, p_load=miniwecc.buses.p_load * 3.0))
    with pytest.raises(NumericalError, match=r"case 'miniwecc' diverged .* at bus \d+"):
        solve_power_flow(heavy)


def test_reactive_power_outside_a_units_limits_is_an_error_that_names_the_bus(
    miniwecc: Case,
) -> None:
    """A unit cannot give reactive power that its table denies it."""
    tight = miniwecc.buses.q_gen_max.copy()
    tight[miniwecc.bus_index(118)] = 1.0
    with pytest.raises(NumericalError, match=r"bus 118: reactive power .* outside \[.*, 1\] pu"):
        solve_power_flow(replace(miniwecc, buses=replace(miniwecc.buses, q_gen_max=tight)))


def test_a_tap_and_a_phase_shift_act_at_the_from_end(miniwecc: Case) -> None:
    """A tap at the wrong end, or a shift of the wrong sign, would turn flows around."""
    tap = miniwecc.branches.tap.copy()
    tap[64] = 1.05 * np.exp(1j * np.deg2rad(4.0))
    shifted = replace(miniwecc, branches=replace(miniwecc.branches, tap=tap))
    flow = solve_power_flow(shifted)
    surplus = injections(shifted, flow) + shifted.buses.p_load + 1j * shifted.buses.q_load
    pq = np.array(shifted.buses.kind) == "pq"
    assert np.abs(surplus)[pq].max() < 1e-10
