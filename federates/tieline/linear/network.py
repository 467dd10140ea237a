"""The network's algebraic equations, differentiated by hand.

    Y V - I_loads(V, f) = sum of Norton sources Y_m E'' + injected currents

with Y the admittance matrix that holds every load as its nominal impedance and I_loads what the
loads' true currents correct. The loads are no analytic functions of V, so all is written in real
and imaginary parts, bus by bus: (re_0, im_0, re_1, ...).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from tieline.grid.loads import UNSEEN, V_LOW_PU, LoadCurrents, nominal_admittance
from tieline.grid.network import admittance
from tieline.grid.plan import Plan
from tieline.grid.system import System

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class NetworkDerivatives:
    """Linear equations of the bus voltages at an operating point.

    Attributes:
        matrix: (2 buses, 2 buses) what multiplies dV.
        by_source: (2 buses, 2 units) current for dE'' = (re, im) of each unit.
        by_filter: (2 buses, filters) current for the frequency, rad/s, that each filter shows.
    """

    matrix: sparse.csc_matrix
    by_source: sparse.csc_matrix
    by_filter: sparse.csc_matrix

    @cached_property
    def factors(self) -> Any:
        """Return SuperLU's factors of the matrix."""
        return splu(self.matrix)


def network_derivatives(system: System) -> NetworkDerivatives:
    """Return the network's derivatives at the operating point of a system."""
    case, plan, v = system.case, system.plan, system.work.v
    buses, bus = len(v), plan.loads.bus
    own = admittance(case.buses, case.branches).tocoo()
    loads, units = np.arange(buses), np.arange(len(plan.unit_bus))
    linear = _parts(
        np.concatenate([own.row, loads, plan.unit_bus]),
        np.concatenate([own.col, loads, plan.unit_bus]),
        np.concatenate([own.data, nominal_admittance(case, system.flow), plan.unit_admittance]),
    )
    corrections = (
        (2 * bus[:, None] + np.array([0, 0, 1, 1])).ravel(),
        (2 * bus[:, None] + np.array([0, 1, 0, 1])).ravel(),
        -_load_slopes(plan.loads, v[bus]).ravel(),
    )
    rows, columns, values = map(np.concatenate, zip(linear, corrections, strict=True))
    matrix = sparse.csc_matrix((values, (rows, columns)), shape=(2 * buses, 2 * buses))
    rows, columns, values = _parts(plan.unit_bus, units, plan.unit_admittance)
    by_source = sparse.csc_matrix((values, (rows, columns)), shape=(2 * buses, 2 * len(units)))
    return NetworkDerivatives(matrix, by_source, _by_filter(plan, v))


def _parts(
    row: NDArray[np.integer], column: NDArray[np.integer], values: Complexes
) -> tuple[NDArray[np.integer], NDArray[np.integer], Floats]:
    """Return the entries of a complex-linear map as those of the real one, twice as wide."""
    g, b = values.real, values.imag
    return (
        np.concatenate([2 * row, 2 * row, 2 * row + 1, 2 * row + 1]),
        np.concatenate([2 * column, 2 * column + 1, 2 * column, 2 * column + 1]),
        np.concatenate([g, -b, b, g]),
    )


def _load_slopes(loads: LoadCurrents, v: Complexes) -> Floats:
    """Return (loads, 2, 2) d(re, im of the correction)/d(re, im of V).

    The correction is (Y0 - y(r)) V with y = conj(S) / |V|^2 and r = |V| / V0, so its derivative is
    that of a complex factor times V, and V times what |V| does to the factor.
    """
    size = np.abs(v)
    r = size / loads.v0
    p_rest = 1.0 - loads.p_power - loads.p_current
    q_rest = 1.0 - loads.q_power - loads.q_current
    # y = (p - jq) / V0^2 with p = P0 (z + i / r + s / r^2), q likewise.
    p = loads.p0 * (p_rest + loads.p_current / r + loads.p_power / r**2)
    q = loads.q0 * (q_rest + loads.q_current / r + loads.q_power / r**2)
    p_slope = -loads.p0 * (loads.p_current / r**2 + 2.0 * loads.p_power / r**3)
    q_slope = -loads.q0 * (loads.q_current / r**2 + 2.0 * loads.q_power / r**3)
    factor = loads.admittance - (p - 1j * q) / loads.v0**2
    by_size = -(p_slope - 1j * q_slope) / loads.v0**3 * v
    is_current = size > V_LOW_PU
    factor, by_size = np.where(is_current, factor, 0.0), np.where(is_current, by_size, 0.0)
    by_re = factor + by_size * v.real / size
    by_im = 1j * factor + by_size * v.imag / size
    return np.stack(
        [np.stack([by_re.real, by_im.real], -1), np.stack([by_re.imag, by_im.imag], -1)], -2
    )


def _by_filter(plan: Plan, v: Complexes) -> sparse.csc_matrix:
    """Return the correction's derivative with the frequency that each load's filter shows."""
    loads, filters = plan.loads, len(plan.sensors.bus)
    seen = np.flatnonzero((loads.filter != UNSEEN) & (np.abs(v[loads.bus]) > V_LOW_PU))
    bus = loads.bus[seen]
    r = np.abs(v[bus]) / loads.v0[seen]
    p_rest = 1.0 - loads.p_power - loads.p_current
    q_rest = 1.0 - loads.q_power - loads.q_current
    p = loads.p0[seen] * (p_rest[seen] * r**2 + loads.p_current[seen] * r + loads.p_power[seen])
    q = loads.q0[seen] * (q_rest[seen] * r**2 + loads.q_current[seen] * r + loads.q_power[seen])
    power = p * loads.p_frequency[seen] - 1j * q * loads.q_frequency[seen]
    slope = -power / v[bus].conj() / (2.0 * np.pi * plan.sensors.f0_Hz)
    columns = loads.filter[seen]
    return sparse.csc_matrix(
        (
            np.concatenate([slope.real, slope.imag]),
            (np.concatenate([2 * bus, 2 * bus + 1]), np.concatenate([columns, columns])),
        ),
        shape=(2 * len(v), filters),
    )


def voltages_for(network: NetworkDerivatives, currents: Floats | sparse.spmatrix) -> Floats:
    """Return (2 buses, k) dV for injected currents (2 buses, k)."""
    dense = currents if isinstance(currents, np.ndarray) else currents.toarray()
    solved: Floats = network.factors.solve(np.ascontiguousarray(dense))
    return solved
