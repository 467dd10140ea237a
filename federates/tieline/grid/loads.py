"""Loads that are not constant impedance, as current corrections to a network that takes them so."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.case import Case
from tieline.grid.network import Factors, solve
from tieline.grid.powerflow import PowerFlow

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

V_LOW_PU = 0.5
"""At and below this voltage a load is its nominal constant impedance, as in the reference: its
current jumps there. A load for which neither side has a solution stays an impedance."""

V_TOLERANCE_PU = 1e-12
"""Largest change of a voltage in the last sweep; the error left is then about a fifth of it."""
MAX_SWEEPS = 60
SWEEPS_TO_CHOOSE = 20
"""Sweeps after which a load at low voltage stays an impedance for the rest of the solution."""

UNSEEN = -1
"""Marks a load that does not answer to frequency."""


class LoadCurrents(NamedTuple):
    """Arrays (m,): bus index, power at the initial voltage `v0`, and its parts.

    Attributes:
        admittance: what the network matrix holds for the whole load, conj(S0) / v0^2.
        p_frequency, q_frequency: relative change of the power for a change of frequency, both pu.
        filter: place among `sensors.Sensors` of the filter that shows the load its frequency, or
            `UNSEEN`.
    """

    bus: NDArray[np.int64]
    p0: Floats
    q0: Floats
    v0: Floats
    p_power: Floats
    p_current: Floats
    q_power: Floats
    q_current: Floats
    admittance: Complexes
    p_frequency: Floats
    q_frequency: Floats
    filter: NDArray[np.int64]


def frequency_buses(case: Case) -> NDArray[np.int64]:
    """Return the bus index of every load that answers to frequency."""
    loads = case.loads
    return loads.bus[(loads.p_frequency != 0) | (loads.q_frequency != 0)]


def nominal_admittance(case: Case, flow: PowerFlow) -> Complexes:
    """Return (n,) every bus's load as the admittance that draws it at the initial voltage."""
    return np.asarray((case.buses.p_load - 1j * case.buses.q_load) / flow.v**2, np.complex128)


def load_currents(case: Case, flow: PowerFlow, pmus: int) -> LoadCurrents:
    """Return the loads of a case that are not wholly constant impedance.

    The filters of those that answer to frequency come after `pmus` others.
    """
    loads, bus = case.loads, case.loads.bus
    follows = np.isin(bus, frequency_buses(case))
    return LoadCurrents(
        bus=bus,
        p0=case.buses.p_load[bus],
        q0=case.buses.q_load[bus],
        v0=flow.v[bus],
        p_power=loads.p_constant_power,
        p_current=loads.p_constant_current,
        q_power=loads.q_constant_power,
        q_current=loads.q_constant_current,
        admittance=nominal_admittance(case, flow)[bus],
        p_frequency=loads.p_frequency,
        q_frequency=loads.q_frequency,
        filter=np.where(follows, pmus + np.cumsum(follows) - 1, UNSEEN),
    )


@compiled
def correction(loads: LoadCurrents, factor: Floats, k: int, v: complex) -> complex:
    """Return the current that the network's constant impedance draws too much for load `k` at `v`.

    With r = |V| / V0, P(r) = P0 (z r^2 + i r + s) (1 + k_p df), likewise Q, and the load drawing
    conj(S / V), this is Y0 V - conj(S(V) / V); at and below `V_LOW_PU` it is nothing. `factor`
    (2, m) holds 1 + k_p df and 1 + k_q df. Source: IEEE Task Force on Load Representation, Load
    representation for dynamic performance analysis, IEEE Trans. Power Systems 8 (1993), eq. 1-6.
    """
    size = abs(v)
    if size <= V_LOW_PU:
        return complex(0.0, 0.0)
    r = size / loads.v0[k]
    p_rest = 1.0 - loads.p_power[k] - loads.p_current[k]
    q_rest = 1.0 - loads.q_power[k] - loads.q_current[k]
    p = factor[0, k] * loads.p0[k] * (p_rest * r * r + loads.p_current[k] * r + loads.p_power[k])
    q = factor[1, k] * loads.q0[k] * (q_rest * r * r + loads.q_current[k] * r + loads.q_power[k])
    return (loads.admittance[k] - complex(p, -q) / (size * size)) * v


@compiled
def settle(
    loads: LoadCurrents,
    transfer: Complexes,
    factor: Floats,
    v_open: Complexes,
    v: Complexes,
    current: Complexes,
) -> bool:
    """Add the loads' corrections to the injected currents; return whether they converged.

    A fixed point of V = V_open + Z dI(V) over the load buses alone. The nominal admittance in the
    network cancels the derivative of a constant-current load along the angle, so that a sweep
    shrinks the error about fivefold.

    Args:
        loads: the loads (m,).
        transfer: (m, m) Z, voltage at each load for a unit current at each load.
        factor: (2, m) what frequency makes of active and reactive power.
        v_open: (buses,) voltages without corrections.
        v: (buses,) where to start, such as the last solution.
        current: (buses,) injected currents, added to.
    """
    count = len(loads.bus)
    here = np.empty(count, np.complex128)
    extra = np.empty(count, np.complex128)
    for k in range(count):
        here[k] = v[loads.bus[k]]
    stays_low = np.zeros(count, np.bool_)
    converged = False
    for sweep in range(MAX_SWEEPS):
        for k in range(count):
            if sweep > SWEEPS_TO_CHOOSE and abs(here[k]) <= V_LOW_PU:
                stays_low[k] = True
            extra[k] = 0.0 if stays_low[k] else correction(loads, factor, k, here[k])
        converged = True
        for k in range(count):
            value = v_open[loads.bus[k]]
            for other in range(count):
                value += transfer[k, other] * extra[other]
            change = value - here[k]
            if not (abs(change.real) <= V_TOLERANCE_PU and abs(change.imag) <= V_TOLERANCE_PU):
                converged = False
            here[k] = value
        if converged:
            break
    for k in range(count):
        if not stays_low[k]:
            current[loads.bus[k]] += correction(loads, factor, k, here[k])
    return converged


def load_transfer(factors: Factors, loads: LoadCurrents) -> Complexes:
    """Return (m, m) the voltage at each load's bus for a unit current into each load's bus."""
    buses = len(factors.u_diagonal)
    scratch, v = np.zeros(buses, np.complex128), np.zeros(buses, np.complex128)
    columns = []
    for bus in loads.bus:
        unit = np.zeros(buses, np.complex128)
        unit[bus] = 1.0
        solve(factors, unit, scratch, v)
        columns.append(v[loads.bus])
    square = (len(columns), len(columns))
    return np.ascontiguousarray(np.array(columns, np.complex128).reshape(square).T)
