"""Loads against the definition of what they draw."""

import numpy as np
import pytest
import scipy.sparse as sparse
from hypothesis import given, settings
from hypothesis import strategies as st

import tieline.grid.loads as loads_module
from tieline.grid.loads import (
    UNSEEN,
    LoadCurrents,
    corrections,
    hasten,
    load_laws,
    load_network,
    settle,
)
from tieline.grid.network import factorise

NOMINAL = np.ones((2, 1))
"""What nominal frequency makes of one load."""


def one_load(p_power: float, p_current: float, q_power: float, q_current: float) -> LoadCurrents:
    """A load of 2 + j0.5 pu at an initial voltage of 0.98 pu."""
    v0 = 0.98
    array = lambda value: np.array([value])  # noqa: E731
    return LoadCurrents(
        bus=np.array([0]),
        p0=array(2.0),
        q0=array(0.5),
        v0=array(v0),
        p_power=array(p_power),
        p_current=array(p_current),
        q_power=array(q_power),
        q_current=array(q_current),
        admittance=array((2.0 - 0.5j) / v0**2),
        p_frequency=array(0.0),
        q_frequency=array(0.0),
        filter=np.array([UNSEEN]),
    )


def correction(load: LoadCurrents, factor: np.ndarray, v: complex) -> complex:
    """What the network's impedance draws too much for the load at a voltage."""
    current = np.zeros((2, 1))
    at = np.array([[v.real], [v.imag]])
    corrections(load_laws(load), factor, np.zeros(1, bool), at, current)
    return complex(current[0, 0], current[1, 0])


def settled(load: LoadCurrents, transfer: complex, v_open: complex) -> tuple[bool, complex]:
    """Whether a load behind an impedance finds its voltage, and that voltage; from 1 pu."""
    factors = factorise(sparse.csc_matrix(np.array([[1.0 / transfer]])))
    v, scratch = np.ones(1, complex), np.zeros((2, 1), complex)
    source = np.array([v_open / transfer])
    converged = settle(load_network(factors, load), factors, NOMINAL, source, scratch, v)
    return converged, complex(v[0])


@pytest.fixture(params=["reduced", "whole"], autouse=True)
def network(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every statement holds for sweeps over the loads alone and over the whole network."""
    if request.param == "whole":
        monkeypatch.setattr(loads_module, "MOST_REDUCED", 0)


shares = st.floats(0.0, 0.5)


@settings(deadline=None)
@given(shares, shares, shares, shares, st.floats(0.5, 1.3, exclude_min=True), st.floats(-3.1, 3.1))
def test_a_load_draws_its_constant_power_current_and_impedance_parts(
    p_power: float, p_current: float, q_power: float, q_current: float, size: float, angle: float
) -> None:
    """A part that followed the wrong power of the voltage would damp or undamp every swing."""
    load = one_load(p_power, p_current, q_power, q_current)
    v = size * np.exp(1j * angle)
    r = size / 0.98
    p = 2.0 * ((1 - p_power - p_current) * r**2 + p_current * r + p_power)
    q = 0.5 * ((1 - q_power - q_current) * r**2 + q_current * r + q_power)
    drawn = load.admittance[0] * v - correction(load, NOMINAL, v)
    # A dozen roundings of numbers of size 10.
    assert v * np.conj(drawn) == pytest.approx(p + 1j * q, abs=1e-13)


@pytest.mark.parametrize("size", [0.5, 0.25, 0.0])
def test_at_half_voltage_and_below_a_load_is_its_nominal_impedance(size: float) -> None:
    """Constant current down to zero voltage has no direction; the reference does the same."""
    load = one_load(0.4, 0.6, 0.0, 1.0)
    assert correction(load, NOMINAL, complex(size)) == 0.0


def test_a_load_that_fits_on_neither_side_of_half_voltage_is_an_impedance() -> None:
    """As constant current it pulls its voltage below a half, as impedance it lets it above."""
    load = one_load(0.0, 1.0, 0.0, 1.0)
    assert settled(load, 0.35 + 0.2j, 0.56 + 0j) == (True, pytest.approx(0.56, abs=1e-15))


@pytest.mark.parametrize("transfer", [0.05j, 0.02 + 0.1j])
def test_the_settled_voltage_satisfies_the_network_and_the_load(transfer: complex) -> None:
    """The algebraic loop must end at its solution, not where the sweeps happened to stop."""
    load = one_load(0.3, 0.7, 0.0, 1.0)
    converged, v = settled(load, transfer, 1.02 + 0.1j)
    assert converged
    # The last sweep moved less than 1e-12, and a sweep shrinks the error.
    current = (v - (1.02 + 0.1j)) / transfer
    assert current == pytest.approx(correction(load, NOMINAL, v), abs=1e-10)


def test_loads_that_no_voltage_satisfies_are_reported() -> None:
    """Beyond the nose of the curve there is no solution; a returned voltage would be a lie."""
    load = one_load(1.0, 0.0, 0.0, 0.0)
    assert not settled(load, 1.5j, 1.0 + 0j)[0]


def test_frequency_scales_active_and_reactive_power_apart() -> None:
    """A load that answered with the wrong part would damp voltage swings instead of speed."""
    load = one_load(0.2, 0.3, 0.4, 0.5)
    v = 0.9 * np.exp(0.4j)
    drawn = [
        v * np.conj(load.admittance[0] * v - correction(load, np.array(factor), v))
        for factor in ([[1.0], [1.0]], [[0.98], [1.03]])
    ]
    assert drawn[1].real == pytest.approx(0.98 * drawn[0].real, abs=1e-13)
    assert drawn[1].imag == pytest.approx(1.03 * drawn[0].imag, abs=1e-13)


def test_a_first_sweep_is_what_it_is_whatever_stands_in_memory() -> None:
    """Or a run would give other bits, or collapse, by what the memory held before it."""
    v, swept = np.full((2, 3), 1.0), np.array([[0.9, 0.8, 0.7], [0.1, 0.2, 0.3]])
    hasten(v, swept, np.full((2, 3), np.nan), np.full((2, 3), np.inf), True)
    np.testing.assert_array_equal(v, swept)
