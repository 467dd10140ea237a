"""Loads that are not constant impedance, as current corrections to a network that takes them so."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled, compiled_in_place
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

MOST_REDUCED = 64
"""Most loads for which a dense matrix between them costs less than the sparse network, whose cost
does not grow with their square."""

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


class LoadNetwork(NamedTuple):
    """What the network and its loads have to settle between them.

    Attributes:
        bus: (m,) bus index; laws: (8, m) what each draws, see `load_laws`.
        transfer: (2, m, m) real and imaginary part of the voltages (last axis) for a unit current
            into each load; (2, 0, 0) where the whole network is solved instead.
    """

    bus: NDArray[np.int64]
    laws: Floats
    transfer: Floats


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


def load_laws(loads: LoadCurrents) -> Floats:
    """Return (8, m) the loads as `corrections` takes them.

    Rows 0 and 1 are the admittance that the network holds for a load; rows 2 to 4 (active) and 5 to
    7 (reactive) its parts of constant impedance, current and power: what |V|^2, |V| and 1 multiply.
    """
    p_rest = 1.0 - loads.p_power - loads.p_current
    q_rest = 1.0 - loads.q_power - loads.q_current
    p0, q0, v0 = loads.p0, loads.q0, loads.v0
    return np.array(
        [
            loads.admittance.real,
            loads.admittance.imag,
            p0 * p_rest / v0**2,
            p0 * loads.p_current / v0,
            p0 * loads.p_power,
            q0 * q_rest / v0**2,
            q0 * loads.q_current / v0,
            q0 * loads.q_power,
        ]
    )


@compiled_in_place
def corrections(
    laws: Floats, factor: Floats, stays_low: NDArray[np.bool_], v: Floats, current: Floats
) -> None:
    """Write the currents (2, m) that the network's impedances draw too much at voltages (2, m).

    With r = |V| / V0, P(r) = P0 (z r^2 + i r + s) (1 + k_p df), likewise Q, and the load drawing
    conj(S / V), this is Y0 V - conj(S(V) / V); at and below `V_LOW_PU` it is nothing. `factor`
    (2, m) holds 1 + k_p df and 1 + k_q df; rows of `v` and `current` are real and imaginary parts.
    Source: IEEE Task Force on Load Representation, Load representation for dynamic performance
    analysis, IEEE Trans. Power Systems 8 (1993), eq. 1-6.
    """
    # Without a branch, and with one root and one quotient a load.
    for k in range(v.shape[1]):
        square = v[0, k] * v[0, k] + v[1, k] * v[1, k]
        s = 1.0 / np.sqrt(max(square, V_LOW_PU * V_LOW_PU))
        g = laws[0, k] - factor[0, k] * (laws[2, k] + s * (laws[3, k] + s * laws[4, k]))
        b = laws[1, k] + factor[1, k] * (laws[5, k] + s * (laws[6, k] + s * laws[7, k]))
        is_impedance = (square <= V_LOW_PU * V_LOW_PU) | stays_low[k]
        g, b = (0.0, 0.0) if is_impedance else (g, b)
        current[0, k] = g * v[0, k] - b * v[1, k]
        current[1, k] = g * v[1, k] + b * v[0, k]


@compiled_in_place
def sweep_reduced(transfer: Floats, v_open: Floats, current: Floats, v: Floats) -> None:
    """Write the loads' voltages (2, m) for currents (2, m): v_open + Z current."""
    for row in range(2):
        for k in range(v.shape[1]):
            v[row, k] = v_open[row, k]
    for other in range(v.shape[1]):
        re, im = current[0, other], current[1, other]
        for k in range(v.shape[1]):
            v[0, k] += transfer[0, other, k] * re - transfer[1, other, k] * im
            v[1, k] += transfer[0, other, k] * im + transfer[1, other, k] * re


@compiled_in_place
def inject(bus: NDArray[np.int64], current: Floats, source: Complexes) -> None:
    """Add currents (2, m) at their buses to the injected currents (buses,)."""
    for k in range(len(bus)):
        source[bus[k]] += complex(current[0, k], current[1, k])


@compiled_in_place
def take(bus: NDArray[np.int64], v: Complexes, at: Floats) -> None:
    """Write real and imaginary part of the voltages of some buses into `at` (2, m)."""
    for k in range(len(bus)):
        at[0, k], at[1, k] = v[bus[k]].real, v[bus[k]].imag


@compiled_in_place
def moved(v: Floats, earlier: Floats) -> float:
    """Return the largest change of a component between voltages (2, m); NaN counts as endless."""
    largest = 0.0
    for row in range(2):
        for k in range(v.shape[1]):
            change = abs(v[row, k] - earlier[row, k])
            if not change <= largest:
                largest = change if change < np.inf else np.inf
    return largest


@compiled_in_place
def hasten(v: Floats, swept: Floats, last_move: Floats, last_swept: Floats, is_first: bool) -> None:
    """Write where the next sweep starts into `v`, from what this one made of it, all (2, m).

    Anderson's method of depth one: the mixture of the last two sweeps whose moves cancel best. A
    share beyond a half tells that the sweeps do not shrink as they should, and is not used.
    Source: Walker and Ni, Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49
    (2011).
    """
    top, bottom = 0.0, 0.0
    for row in range(2):
        for k in range(v.shape[1]):
            move = swept[row, k] - v[row, k]
            top += move * (move - last_move[row, k])
            bottom += (move - last_move[row, k]) ** 2
    share = 0.0 if is_first or not bottom > 0.0 else top / bottom
    share = share if abs(share) <= 0.5 else 0.0
    for row in range(2):
        for k in range(v.shape[1]):
            # At the first sweep the last one's memory may hold anything, also what is no number.
            step_back = 0.0 if share == 0.0 else share * (swept[row, k] - last_swept[row, k])
            last_move[row, k] = swept[row, k] - v[row, k]
            v[row, k] = swept[row, k] - step_back
            last_swept[row, k] = swept[row, k]


@compiled
def settle(
    network: LoadNetwork,
    factors: Factors,
    factor: Floats,
    source: Complexes,
    scratch: Complexes,
    v: Complexes,
) -> bool:
    """Write all voltages with the loads' corrections in them; return whether those converged.

    A fixed point of V = Z (I + dI(V)). The nominal admittance in the network cancels the derivative
    of a constant-current load along the angle, so that a sweep shrinks the error about fivefold.
    Sweeps go over the load buses alone, through a dense matrix between them, or over the whole
    sparse network where there are more than `MOST_REDUCED`.

    Args:
        network: the loads (m,).
        factors: of the network.
        factor: (2, m) what frequency makes of active and reactive power.
        source: (buses,) injected currents without the loads' corrections.
        scratch: (2, buses).
        v: (buses,) where to start, such as the last solution.
    """
    bus = network.bus
    count = len(bus)
    here, there = np.empty((2, count)), np.empty((2, count))
    v_open, current = np.empty((2, count)), np.empty((2, count))
    last_move, last_swept = np.empty((2, count)), np.empty((2, count))
    stays_low = np.zeros(count, np.bool_)
    is_reduced = network.transfer.shape[1] == count
    total = scratch[1]
    take(bus, v, here)
    if is_reduced:
        solve(factors, source, scratch[0], v)
        take(bus, v, v_open)
    converged = False
    for sweep in range(MAX_SWEEPS):
        if sweep > SWEEPS_TO_CHOOSE:
            for k in range(count):
                low = here[0, k] ** 2 + here[1, k] ** 2 <= V_LOW_PU**2
                stays_low[k] = stays_low[k] or low
        corrections(network.laws, factor, stays_low, here, current)
        if is_reduced:
            sweep_reduced(network.transfer, v_open, current, there)
        else:
            total[:] = source
            inject(bus, current, total)
            solve(factors, total, scratch[0], v)
            take(bus, v, there)
        converged = moved(there, here) <= V_TOLERANCE_PU
        if converged:
            break
        hasten(here, there, last_move, last_swept, sweep == 0)
    if is_reduced:
        corrections(network.laws, factor, stays_low, there, current)
        total[:] = source
        inject(bus, current, total)
        solve(factors, total, scratch[0], v)
    return converged


def load_network(factors: Factors, loads: LoadCurrents) -> LoadNetwork:
    """Return what `settle` needs of a network and its loads."""
    count = len(loads.bus)
    if count > MOST_REDUCED:
        return LoadNetwork(loads.bus, load_laws(loads), np.zeros((2, 0, 0)))
    buses = len(factors.u_reciprocal)
    scratch, v = np.zeros(buses, np.complex128), np.zeros(buses, np.complex128)
    transfer = np.zeros((2, count, count))
    for row, bus in enumerate(loads.bus):
        unit = np.zeros(buses, np.complex128)
        unit[bus] = 1.0
        solve(factors, unit, scratch, v)
        transfer[:, row] = v[loads.bus].real, v[loads.bus].imag
    return LoadNetwork(loads.bus, load_laws(loads), transfer)
