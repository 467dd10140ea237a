"""The linear system with its voltages kept, as one sparse matrix.

    [dx/dt]   [Axx  Axy] [x]
    [  0  ] = [Ayx  Ayy] [y],     y = (voltages re, im bus by bus; v_s of each unit; wbar)

Eliminating y gives the matrix A of `linearise`, which is full. Kept, every unit meets the rest
through few entries, and a solution with A - s is one with the sparse matrix less s on its upper
diagonal (Martins, Efficient eigenvalue and frequency response methods applied to power system
small-signal stability studies, IEEE Trans. Power Systems 1, 1986).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from tieline.errors import NumericalError
from tieline.grid.blocks import EMPTY
from tieline.grid.models.base import SIGNALS
from tieline.linear._krylov import Solve
from tieline.linear.differences import PSS_OUT, V_IM, V_RE, V_S_IN, WBAR
from tieline.linear.linearise import LinearSystem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
BALANCINGS = 30
"""Sweeps that balance a matrix; a few percent are left to gain."""

Entries = tuple[NDArray[np.int64], NDArray[np.int64], Floats]


@dataclass(frozen=True)
class Descriptor:
    """A linear system with its algebraic variables, the average undelayed.

    Attributes:
        linear: the system.
        matrix: (n + m, n + m) [[Axx, Axy], [Ayx, Ayy]].
        states: n.
    """

    linear: LinearSystem
    matrix: sparse.csc_matrix
    states: int

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the states, then of the voltages, v_s and the average."""
        case = self.linear.system.case
        voltages = [f"{part}.B{bus}" for bus in case.buses.number for part in ("v_re", "v_im")]
        given = [f"v_s.{unit}" for unit in case.units]
        return (*self.linear.states, *voltages, *given, "wbar")

    @cached_property
    def scale(self) -> Floats:
        """Return (n + m,) by what each variable is divided so that rows and columns weigh alike.

        Osborne's iteration on the 2-norms of rows and columns beside the diagonal (Osborne, On
        pre-conditioning of matrices, J. ACM 7, 1960), all at once and therefore by half a step.
        Without it eigenvalues are a thousand times as sensitive as they need be, and searches
        believe what they have not seen.
        """
        entries = self.matrix.tocoo()
        beside = (entries.row != entries.col) & (entries.data != 0)
        row, column, size = entries.row[beside], entries.col[beside], entries.data[beside] ** 2
        scale = np.ones(len(self.names))
        for _ in range(BALANCINGS):
            now = size * (scale[column] / scale[row]) ** 2
            of_row = np.bincount(row, now, len(scale))
            of_column = np.bincount(column, now, len(scale))
            joined = (of_row > 0) & (of_column > 0)
            scale[joined] *= (of_row[joined] / of_column[joined]) ** 0.125
        return scale

    @cached_property
    def balanced(self) -> sparse.csc_matrix:
        """Return the matrix for variables divided by `scale`."""
        return (sparse.diags(1.0 / self.scale) @ self.matrix @ sparse.diags(self.scale)).tocsc()

    def inverse(self, shift: complex, transposed: bool = False) -> Solve:
        """Return what multiplies columns (n, k) by (A - shift)^-1, or by its transpose.

        A is that of states divided by `scale`.

        Raises:
            NumericalError: the shift, 1/s, is an eigenvalue.
        """
        size, n = self.matrix.shape[0], self.states
        diagonal = np.concatenate([np.full(n, shift), np.zeros(size - n)])
        shifted = (self.balanced - sparse.diags(diagonal)).tocsc()
        try:
            factors = splu(
                shifted,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.01,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise NumericalError(f"{shift:.6g} 1/s is an eigenvalue itself ({error})") from error
        how = "T" if transposed else "N"

        def solve(columns: Complexes) -> Complexes:
            right = np.zeros((size, columns.shape[1]), np.complex128, order="F")
            right[:n] = columns
            return np.asarray(factors.solve(right, how)[:n], np.complex128)

        return solve


def descriptor(linear: LinearSystem) -> Descriptor:
    """Return a linear system with its voltages, stabilisers' outputs and average kept."""
    n, units = len(linear.states), linear.blocks.units
    v = n + 2 * linear.blocks.bus
    v_s = n + linear.network.matrix.shape[0] + np.arange(units)
    wbar = int(v_s[-1]) + 1
    parts = [*_blocks(linear, v, v_s, wbar), *_network(linear), *_stabilisers(linear, v, v_s, wbar)]
    average = linear.average_weights @ linear.average_rows
    parts += [_entries(wbar, np.arange(n), average), _entries(wbar, wbar, np.array([-1.0]))]
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    size = wbar + 1
    return Descriptor(linear, sparse.csc_matrix((values, (rows, columns)), shape=(size, size)), n)


def _entries(rows: Any, columns: Any, values: Floats) -> Entries:
    """Return what is not zero of values at places that are broadcast to them."""
    rows, columns, values = np.broadcast_arrays(rows, columns, values)
    kept = values != 0
    return rows[kept], columns[kept], values[kept]


def _blocks(
    linear: LinearSystem, v: NDArray[np.int64], v_s: NDArray[np.int64], wbar: int
) -> list[Entries]:
    """Return the rows of the states: dx = A_b x + B_b (V, v_s, wbar) in each block."""
    place, local, units = linear.blocks.place, linear.local, linear.blocks.units
    taken = place != EMPTY
    pairs = taken[:, :, None] & taken[:, None, :]
    row, column = np.broadcast_arrays(place[:, :, None], place[:, None, :])
    block, slot = np.nonzero(taken)
    at, by_input = place[block, slot], local.by_input[block, slot]
    of_unit = block < units
    return [
        _entries(row[pairs], column[pairs], local.by_state[pairs]),
        _entries(at, v[block], by_input[:, V_RE]),
        _entries(at, v[block] + 1, by_input[:, V_IM]),
        _entries(at[of_unit], v_s[block[of_unit]], by_input[of_unit, V_S_IN]),
        _entries(at[of_unit], wbar, by_input[of_unit, WBAR]),
    ]


def _network(linear: LinearSystem) -> list[Entries]:
    """Return the rows of the voltages: 0 = -N V + currents of sources and of filters' loads."""
    n, blocks, network = len(linear.states), linear.blocks, linear.network
    unit, slot = np.nonzero(blocks.place[: blocks.units] != EMPTY)
    at = blocks.place[unit, slot]
    sources = sparse.csc_matrix((2 * blocks.units, n))
    for axis, name in enumerate(("Epp_re", "Epp_im")):
        by_state = linear.local.signals_by_state[SIGNALS.index(name)][unit, slot]
        sources += sparse.csc_matrix((by_state, (2 * unit + axis, at)), shape=sources.shape)
    sensors = linear.system.plan.sensors
    filters = np.arange(len(sensors.bus))
    shown = sensors.x0 + len(filters) + filters
    seen = sparse.csc_matrix((np.ones(len(filters)), (filters, shown)), shape=(len(filters), n))
    currents = (network.by_source @ sources + network.by_filter @ seen).tocoo()
    matrix = network.matrix.tocoo()
    return [
        _entries(n + matrix.row, n + matrix.col, -matrix.data),
        _entries(n + currents.row, currents.col, currents.data),
    ]


def _stabilisers(
    linear: LinearSystem, v: NDArray[np.int64], v_s: NDArray[np.int64], wbar: int
) -> list[Entries]:
    """Return the rows of v_s: 0 = -v_s + what the stabiliser gives, if it is not cut off."""
    place, units, local = linear.blocks.place, linear.blocks.units, linear.local
    unit, slot = np.nonzero((place[:units] != EMPTY) & ~linear.severed[:, None])
    by_input = np.where(linear.severed[:, None], 0.0, local.signals_by_input[PSS_OUT])
    return [
        _entries(v_s, v_s, np.full(units, -1.0)),
        _entries(v_s[unit], place[unit, slot], local.signals_by_state[PSS_OUT][unit, slot]),
        _entries(v_s, v[:units], by_input[:, V_RE]),
        _entries(v_s, v[:units] + 1, by_input[:, V_IM]),
        _entries(v_s, wbar, by_input[:, WBAR]),
    ]
