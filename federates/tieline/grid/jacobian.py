"""The derivatives of a system cut into blocks, and the linear solution that they allow.

With r_b the residual of block b, a = h/2, and all derivatives taken as finite differences of the
very equations that are integrated,

    (1 - a A_b) dx_b = r_b + a B_b dv_b,     dE_u = G_u dx_u,     dv = S dE

Eliminating the blocks leaves two real unknowns a unit, (1 - K S_uu) dE = g with g = G (1 - aA)^-1 r
and K = G (1 - aA)^-1 a B: to the network every unit has become an admittance. S contains whatever
stands in the network, loads included. Turning all rotors together changes none of it but the frame,
so that it outlives an excursion of frequency. The coupling through wbar is left out: its loop is
slow against a step and costs an iteration at most.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.blocks import EMPTY, Blocks
from tieline.grid.equations import EPP_IM, EPP_RE, rhs_at_voltages, show_voltages, solve_network
from tieline.grid.plan import Plan, Work

Floats = NDArray[np.float64]

STEP, RELATIVE_STEP = 1e-6, 1e-9
"""Step of the differences in pu or rad, and what a state of size 1 adds to it."""


class Derivatives(NamedTuple):
    """The derivatives of a system at one point.

    Attributes:
        A: (blocks, size, size) df/dx at constant voltage; B: (blocks, size, 2) df/d(v_re, v_im).
        G: (units, 2, size) d(Epp_re, Epp_im)/dx; S: (2 blocks, 2 units) dv/dE.
    """

    A: Floats
    B: Floats
    G: Floats
    S: Floats


class Elimination(NamedTuple):
    """What `correct` needs, stored so that it runs along rows.

    Attributes:
        inverse: (blocks, size, size) transpose of (1 - a A)^-1.
        G: (units, 2, size) d(Epp_re, Epp_im)/dx.
        response: (2 units, 2 blocks) dv for each g.
        by_voltage: (blocks, 2, size) (1 - a A)^-1 a B, transposed.
    """

    inverse: Floats
    G: Floats
    response: Floats
    by_voltage: Floats


def differentiate(functions: Any, plan: Plan, work: Work, blocks: Blocks, x: Floats) -> Derivatives:
    """Return the derivatives at `x` and at the voltages in `work`, which `x` has led to.

    `work` is left at the same point, but for the last bits of its voltages.
    """
    A, G = _by_states(functions, plan, work, blocks, x)
    B = _by_voltages(functions, plan, work, blocks, x)
    return Derivatives(A, B, G, _of_network(plan, work, blocks))


def _smaller(up: Floats, down: Floats) -> Floats:
    """Return the quotients of the side that is smooth.

    Two sides differ at a limiter; across a jump the larger of the quotients is no derivative.
    """
    return np.where(np.abs(up) <= np.abs(down), up, down)


def _by_states(
    functions: Any, plan: Plan, work: Work, blocks: Blocks, x: Floats
) -> tuple[Floats, Floats]:
    """Return A and G: the same state of every block is moved at once, up and down."""
    count, width = blocks.place.shape
    A, G = np.zeros((2, count, width, width)), np.zeros((2, blocks.units, 2, width))
    moved, f, f_at = np.empty_like(x), np.zeros_like(x), np.zeros_like(x)
    rhs_at_voltages(functions, plan, work, x, f_at)
    E_at = work.signals[[EPP_RE, EPP_IM]]
    for column in range(width):
        at = blocks.place[:, column]
        for side, sign in enumerate((1.0, -1.0)):
            moved[:] = x
            moved[at[at != EMPTY]] += sign * (STEP + RELATIVE_STEP * np.abs(x[at[at != EMPTY]]))
            d = np.where(at != EMPTY, moved[at] - x[at], np.inf)
            rhs_at_voltages(functions, plan, work, moved, f)
            A[side, :, :, column] = _by_block(f - f_at, blocks) / d[:, None]
            E = work.signals[[EPP_RE, EPP_IM]]
            G[side, :, :, column] = ((E - E_at) / d[: blocks.units]).T
    rhs_at_voltages(functions, plan, work, x, f)
    return _smaller(*A), _smaller(*G)


def _by_voltages(functions: Any, plan: Plan, work: Work, blocks: Blocks, x: Floats) -> Floats:
    """Return B: every bus voltage is moved at once, along one axis and then the other."""
    v = work.v.copy()
    B = np.zeros((2, *blocks.place.shape, 2))
    f, f_at = np.zeros_like(x), np.zeros_like(x)
    rhs_at_voltages(functions, plan, work, x, f_at)
    for axis, direction in enumerate((1.0, 1.0j)):
        for side, sign in enumerate((1.0, -1.0)):
            work.v[:] = v + sign * STEP * direction
            show_voltages(plan, work)
            rhs_at_voltages(functions, plan, work, x, f)
            B[side, :, :, axis] = _by_block(f - f_at, blocks) / (sign * STEP)
    work.v[:] = v
    show_voltages(plan, work)
    return _smaller(*B)


def _of_network(plan: Plan, work: Work, blocks: Blocks) -> Floats:
    """Return S: one source after the other is moved, along both axes."""
    solve_network(plan, work)
    v = work.v.copy()
    S = np.zeros((2 * len(blocks.bus), 2 * blocks.units))
    for unit in range(blocks.units):
        for axis, row in enumerate((EPP_RE, EPP_IM)):
            at = work.signals[row, unit]
            work.signals[row, unit] = at + STEP
            solve_network(plan, work)
            work.signals[row, unit] = at
            d = (work.v - v)[blocks.bus] / STEP
            S[0::2, 2 * unit + axis], S[1::2, 2 * unit + axis] = d.real, d.imag
            work.v[:] = v
    show_voltages(plan, work)
    return S


def _by_block(values: Floats, blocks: Blocks) -> Floats:
    """Return values of all states (n,) as (blocks, size), with 0 in empty places."""
    return np.where(blocks.place != EMPTY, values[blocks.place], 0.0)


def eliminate(
    blocks: Blocks, at: Derivatives, is_held: NDArray[np.bool_], a: float
) -> Elimination | None:
    """Return what `correct` needs, for a = h/2; None where a matrix is singular.

    Args:
        blocks, at: the system.
        is_held: (n,) states that stand at a limit; their correction is 0.
        a: half a step, s.
    """
    is_free = ~is_held[blocks.place][:, :, None]
    identity = np.eye(blocks.place.shape[1])
    inverse = invert(np.where(is_free, identity - a * at.A, identity))
    if inverse is None:
        return None
    by_voltage = product(inverse, np.where(is_free, a * at.B, 0.0))
    K = product(at.G, by_voltage[: blocks.units])
    units, wide = blocks.units, 2 * blocks.units
    K_S = product(K, at.S[:wide].reshape(units, 2, wide)).reshape(wide, wide)
    Q = invert((np.eye(wide) - K_S)[None])
    if Q is None:
        return None
    response = product(at.S, Q[0])
    return Elimination(*(np.ascontiguousarray(item) for item in (
        inverse.transpose(0, 2, 1), at.G, response.T, by_voltage.transpose(0, 2, 1)
    )))  # fmt: skip


def product(left: Floats, right: Floats) -> Floats:
    """Return the matrix product over the last two axes, with sums in an order of our own.

    A library's order may change from machine to machine, and with it the last bit.
    """
    result = np.zeros((*left.shape[:-1], right.shape[-1]))
    for k in range(left.shape[-1]):
        result += left[..., :, k, None] * right[..., None, k, :]
    return result


def invert(matrices: Floats) -> Floats | None:
    """Return the inverses of matrices (count, n, n), None where one is singular.

    Gauss-Jordan elimination with row pivoting.
    """
    count, n, _ = matrices.shape
    every = np.arange(count)
    both = np.concatenate([matrices, np.broadcast_to(np.eye(n), matrices.shape)], axis=2)
    for column in range(n):
        pivot = column + np.argmax(np.abs(both[:, column:, column]), axis=1)
        rows = both[every, pivot]
        both[every, pivot] = both[:, column]
        if not (rows[:, column] != 0.0).all():
            return None
        rows /= rows[:, column, None]
        both[:, column] = 0.0
        both -= both[:, :, column, None] * rows[:, None, :]
        both[:, column] = rows
    return both[:, :, n:]


@compiled
def correct(blocks: Blocks, by: Elimination, residual: Floats, dx: Floats) -> None:
    """Write the correction `dx` (n,) of the states that takes away the residual (n,)."""
    own = np.zeros(blocks.place.shape)
    dv = np.zeros(2 * len(blocks.bus))
    for b in range(len(blocks.size)):
        for k in range(blocks.size[b]):
            value = residual[blocks.place[b, k]]
            for row in range(blocks.size[b]):
                own[b, row] += by.inverse[b, k, row] * value
    for u in range(blocks.units):
        for axis in range(2):
            g = 0.0
            for k in range(blocks.size[u]):
                g += by.G[u, axis, k] * own[u, k]
            for port in range(len(dv)):
                dv[port] += by.response[2 * u + axis, port] * g
    for b in range(len(blocks.size)):
        for k in range(blocks.size[b]):
            by_re, by_im = by.by_voltage[b, 0, k], by.by_voltage[b, 1, k]
            dx[blocks.place[b, k]] = own[b, k] + by_re * dv[2 * b] + by_im * dv[2 * b + 1]
