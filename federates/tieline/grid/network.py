"""The transmission network: its admittance matrix, islands, sparse factors and their solution."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from tieline.compiled import compiled_in_place
from tieline.errors import NumericalError
from tieline.grid.case import Branches, Buses

Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]


class Factors(NamedTuple):
    """L U of an admittance matrix with rows and columns permuted, both triangles by columns.

    The diagonal of U is stored apart, as reciprocals: a complex division costs as much as ten
    products. `perm_r` and `perm_c` are SuperLU's.
    """

    perm_r: Integers
    perm_c: Integers
    l_start: Integers
    l_row: Integers
    l_value: Complexes
    u_start: Integers
    u_row: Integers
    u_value: Complexes
    u_reciprocal: Complexes


def admittance(
    buses: Buses, branches: Branches, is_open: Collection[int] = ()
) -> sparse.csc_matrix:
    """Return the bus admittance matrix (n, n), system base, of branches and bus shunts.

    Args:
        buses: with their shunts.
        branches: pi sections, half of the charging at each end, ideal tap at the `from` end.
        is_open: rows of branches that are open at both ends.
    """
    count = len(buses.number)
    closed = np.array([row for row in range(len(branches.start)) if row not in is_open], np.int64)
    start, end, tap = branches.start[closed], branches.end[closed], branches.tap[closed]
    series = 1.0 / branches.impedance[closed]
    half = 0.5j * branches.susceptance[closed]
    values = [
        (series + half) / np.abs(tap) ** 2,
        -series / tap.conj(),
        -series / tap,
        series + half,
        buses.g_shunt + 1j * buses.b_shunt,
    ]
    own = np.arange(count)
    rows = np.concatenate([start, start, end, end, own])
    columns = np.concatenate([start, end, start, end, own])
    return sparse.csc_matrix((np.concatenate(values), (rows, columns)), shape=(count, count))


def islands(branches: Branches, count: int, is_open: Collection[int] = ()) -> list[Integers]:
    """Return the bus indices of each connected part of the network."""
    closed = np.array([row for row in range(len(branches.start)) if row not in is_open], np.int64)
    ones = np.ones(len(closed))
    graph = sparse.csr_matrix(
        (ones, (branches.start[closed], branches.end[closed])), shape=(count, count)
    )
    parts, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == part) for part in range(parts)]


def factorise(matrix: sparse.csc_matrix) -> Factors:
    """Return the factors of an admittance matrix.

    Raises:
        NumericalError: the matrix is singular, as with an island that holds no source.
    """
    try:
        lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.1)
    except RuntimeError as error:
        raise NumericalError(f"the network's admittance matrix is singular ({error})") from error
    lower, upper = lu.L.tocsc(), lu.U.tocsc()
    diagonal = upper.diagonal()
    strict_lower = sparse.tril(lower, -1, format="csc")
    strict_upper = sparse.triu(upper, 1, format="csc")
    return Factors(
        perm_r=lu.perm_r.astype(np.int64),
        perm_c=lu.perm_c.astype(np.int64),
        l_start=strict_lower.indptr.astype(np.int64),
        l_row=strict_lower.indices.astype(np.int64),
        l_value=strict_lower.data.astype(np.complex128),
        u_start=strict_upper.indptr.astype(np.int64),
        u_row=strict_upper.indices.astype(np.int64),
        u_value=strict_upper.data.astype(np.complex128),
        u_reciprocal=(1.0 / diagonal).astype(np.complex128),
    )


@compiled_in_place
def solve(factors: Factors, current: Complexes, scratch: Complexes, v: Complexes) -> None:
    """Write the voltages (n,) that belong to the injected currents (n,); `scratch` is (n,)."""
    count = len(current)
    for i in range(count):
        scratch[factors.perm_r[i]] = current[i]
    for j in range(count):
        value = scratch[j]
        for k in range(factors.l_start[j], factors.l_start[j + 1]):
            scratch[factors.l_row[k]] -= factors.l_value[k] * value
    for j in range(count - 1, -1, -1):
        value = scratch[j] * factors.u_reciprocal[j]
        scratch[j] = value
        for k in range(factors.u_start[j], factors.u_start[j + 1]):
            scratch[factors.u_row[k]] -= factors.u_value[k] * value
    for i in range(count):
        v[i] = scratch[factors.perm_c[i]]
