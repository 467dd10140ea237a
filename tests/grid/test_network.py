"""The sparse factors against a dense solution, and islands."""

import numpy as np
import pytest
import scipy.sparse as sparse

from tieline.errors import NumericalError
from tieline.grid.case import Case
from tieline.grid.loads import nominal_admittance
from tieline.grid.network import admittance, factorise, islands, solve
from tieline.grid.system import System
from tieline.grid.topology import NetworkState, network_matrix


def test_the_factors_solve_what_a_dense_solver_solves(system: System) -> None:
    """A permutation applied the wrong way round would still look like voltages."""
    machine = np.zeros(122, complex)
    np.add.at(machine, system.plan.unit_bus, system.plan.unit_admittance)
    load = nominal_admittance(system.case, system.flow)
    matrix = network_matrix(system.case, NetworkState(), load, machine, system.flow.v)
    rng = np.random.default_rng(7)
    current = rng.normal(size=122) + 1j * rng.normal(size=122)
    v, scratch = np.zeros(122, complex), np.zeros(122, complex)
    solve(factorise(matrix), current, scratch, v)
    dense = np.linalg.solve(matrix.toarray(), current)
    # The condition number is some 1e4: four digits lost of sixteen.
    np.testing.assert_allclose(v, dense, rtol=0, atol=1e-11 * np.abs(dense).max())


def test_an_open_branch_leaves_the_matrix_as_if_it_had_never_been_there(miniwecc: Case) -> None:
    """A trip that left a trace of its branch would be no trip."""
    row = miniwecc.branches.name.index("7-10")
    whole = admittance(miniwecc.buses, miniwecc.branches).toarray()
    without = admittance(miniwecc.buses, miniwecc.branches, [row]).toarray()
    y = 1.0 / miniwecc.branches.impedance[row]
    i, j = miniwecc.bus_index(7), miniwecc.bus_index(10)
    expected = whole.copy()
    expected[[i, j], [i, j]] -= y
    expected[[i, j], [j, i]] += y
    np.testing.assert_allclose(without, expected, rtol=0, atol=1e-9)


def test_opening_a_step_up_branch_makes_an_island_of_the_unit(miniwecc: Case) -> None:
    """Averages leave out what is no longer part of the interconnection."""
    assert len(islands(miniwecc.branches, 122)) == 1
    row = miniwecc.branches.name.index("60-61")
    parts = islands(miniwecc.branches, 122, [row])
    assert sorted(len(part) for part in parts) == [1, 121]
    assert [miniwecc.bus_index(60)] in [part.tolist() for part in parts]


def test_a_network_without_a_source_is_refused() -> None:
    """A singular matrix must not give voltages."""
    with pytest.raises(NumericalError, match="singular"):
        factorise(sparse.csc_matrix(np.array([[1.0, -1.0], [-1.0, 1.0]], complex)))
