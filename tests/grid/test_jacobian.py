"""The block elimination against the same linear system solved whole."""

import numpy as np
import pytest

from tieline.grid.blocks import EMPTY, cut
from tieline.grid.equations import EPP_IM, EPP_RE, rhs, solve_network
from tieline.grid.jacobian import correct, differentiate, eliminate, invert, product
from tieline.grid.system import System


def copy_of_work(system: System):
    return type(system.work)._make(array.copy() for array in system.work)


def test_every_state_belongs_to_one_block(system: System) -> None:
    """A state that no block holds would never be corrected."""
    blocks = cut(system.plan, len(system.x0))
    held = blocks.place[blocks.place != EMPTY]
    assert sorted(held) == list(range(len(system.x0)))
    assert blocks.size.sum() == len(system.x0)
    for b, unit in enumerate(system.case.units):
        names = [system.labels[i] for i in blocks.place[b, : blocks.size[b]]]
        assert {name.rsplit(".", 1)[1] for name in names} == {unit}


def test_a_state_outside_all_blocks_is_refused(system: System) -> None:
    """A new kind of state must find its block before it meets this method."""
    with pytest.raises(ValueError, match="belongs to no unit and no sensor"):
        cut(system.plan, len(system.x0) + 1)


def test_the_correction_is_that_of_the_whole_system(system: System) -> None:
    """dx = (1 - a J)^-1 r with J = df/dx, the network solved, wbar as it stands."""
    work, blocks, a = copy_of_work(system), cut(system.plan, len(system.x0)), 1 / 120
    plan = system.plan._replace(average=system.plan.average._replace(mode=0))
    x, n = system.x0, len(system.x0)
    f = np.zeros(n)
    assert rhs(system.functions, plan, work, x, f)
    by = eliminate(blocks, differentiate(system.functions, plan, work, blocks, x), x != x, a)
    assert by is not None
    whole = np.zeros((n, n))
    for i in range(n):
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[i] += sign * 1e-6
            assert rhs(system.functions, plan, work, moved, f)
            whole[:, i] += sign * f / 2e-6
    residual, dx = np.random.default_rng(1).normal(size=n), np.zeros(n)
    correct(blocks, by, residual, dx)
    expected = np.linalg.solve(np.eye(n) - a * whole, residual)
    # Differences of 1e-6 of functions whose second derivatives times gains reach 100.
    np.testing.assert_allclose(dx, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_a_held_state_is_not_corrected(system: System) -> None:
    """What stands at a limit stays there, and the others reckon with that."""
    work, blocks, x = copy_of_work(system), cut(system.plan, len(system.x0)), system.x0
    at = differentiate(system.functions, system.plan, work, blocks, x)
    is_held = np.zeros(len(x), dtype=bool)
    is_held[system.labels.index("exciter.V_R.G3")] = True
    by = eliminate(blocks, at, is_held, 1 / 120)
    assert by is not None
    dx = np.zeros(len(x))
    correct(blocks, by, np.where(is_held, 0.0, 1e-3), dx)
    assert dx[is_held] == 0.0
    assert np.abs(dx[~is_held]).min() > 0.0


def test_differences_leave_the_point_where_it_was(system: System) -> None:
    """A step goes on from it."""
    work, blocks, x = copy_of_work(system), cut(system.plan, len(system.x0)), system.x0.copy()
    before = np.zeros_like(x)
    rhs(system.functions, system.plan, work, x, before)
    signals, v = work.signals.copy(), work.v.copy()
    differentiate(system.functions, system.plan, work, blocks, x)
    np.testing.assert_array_equal(x, system.x0)
    # The network is solved once more, to its tolerance of 1e-12.
    np.testing.assert_allclose(work.v, v, rtol=0, atol=1e-11)
    rows = [EPP_RE, EPP_IM]
    np.testing.assert_array_equal(work.signals[rows], signals[rows])
    assert solve_network(system.plan, work)


def test_inverse_and_product_are_those_of_linear_algebra() -> None:
    """Written anew because a library's order of sums is not the same on every machine."""
    random = np.random.default_rng(7)
    matrices = random.normal(size=(5, 9, 9))
    matrices[0, 0, 0] = 0.0
    inverses = invert(matrices)
    assert inverses is not None
    # Condition numbers of 1e2 to 1e3.
    unit = np.broadcast_to(np.eye(9), (5, 9, 9))
    np.testing.assert_allclose(product(matrices, inverses), unit, atol=1e-11)
    left, right = random.normal(size=(5, 2, 9)), random.normal(size=(5, 9, 3))
    np.testing.assert_allclose(product(left, right), left @ right, atol=1e-13)


def test_a_singular_matrix_has_no_inverse() -> None:
    """Infinity must not enter a step as if it were a number."""
    assert invert(np.ones((1, 3, 3))) is None
