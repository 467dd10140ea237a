"""Loads that are not constant impedance, as current corrections to a network that takes them so."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.case import Case
from tieline.grid.powerflow import PowerFlow

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

V_LOW_PU = 0.5
"""Below this voltage every load is a constant impedance, joined continuously."""


class LoadCurrents(NamedTuple):
    """Arrays (m,): bus index, power at the initial voltage `v0`, and its parts.

    `admittance` is what the network matrix holds for the whole load: conj(S0) / v0^2.
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


def nominal_admittance(case: Case, flow: PowerFlow) -> Complexes:
    """Return (n,) every bus's load as the admittance that draws it at the initial voltage."""
    return (case.buses.p_load - 1j * case.buses.q_load) / flow.v**2


def load_currents(case: Case, flow: PowerFlow) -> LoadCurrents:
    """Return the loads of a case that are not wholly constant impedance."""
    loads, bus = case.loads, case.loads.bus
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
    )


@compiled
def correct(loads: LoadCurrents, v: Complexes, current: Complexes) -> None:
    """Add, at each load's bus, what the network's constant impedance draws too much.

    With r = |V| / V0, P(r) = P0 (z r^2 + i r + s), likewise Q, and the load drawing conj(S / V),
    the correction is Y0 V - conj(S(V) / V). Below `V_LOW_PU` the admittance stays what it is
    there. Y0 cancels the derivative of a constant-current load along the angle, which is why a few
    fixed-point sweeps of the network are enough.
    """
    for k in range(len(loads.bus)):
        at = loads.bus[k]
        size = abs(v[at])
        r = max(size, V_LOW_PU) / loads.v0[k]
        p_rest = 1.0 - loads.p_power[k] - loads.p_current[k]
        q_rest = 1.0 - loads.q_power[k] - loads.q_current[k]
        p = loads.p0[k] * (p_rest * r * r + loads.p_current[k] * r + loads.p_power[k])
        q = loads.q0[k] * (q_rest * r * r + loads.q_current[k] * r + loads.q_power[k])
        held = max(size, V_LOW_PU)
        drawn = complex(p, -q) / (held * held)
        current[at] += (loads.admittance[k] - drawn) * v[at]
