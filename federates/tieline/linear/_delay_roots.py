"""Roots of the exact characteristic equation of a loop with delays.

    M(s) v = 0,   M(s) = s I - A - b sum_k exp(-s tau_k) c_k

In coordinates where A is a Hessenberg matrix and b a multiple of the first unit vector, M(s) is a
Hessenberg matrix for every s and all delays, and a solution costs n^2 operations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.errors import InputError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_EXACT = 1e-12
"""Largest relative residual of a root; rounding leaves 1e-16 to 1e-14."""

SHORTEST_S, LONGEST_S = 1e-6, 10.0
"""Bounds of a delay other than 0: the eigenvalues of a line go with 1/tau and drown those of the
system in their rounding; exp(-s tau) of a well damped mode leaves the range of numbers."""

CONFIRMED = 1e-3
"""Largest way, relative, from an approximate eigenvalue to the exact one that it stands for."""

_ITERATIONS = 25
_LARGEST_EXPONENT = 200.0
"""Where exp(-s tau) ends: beyond, squares of what it enters overflow."""

LOWEST_HZ, HIGHEST_HZ = 0.02, 2.5
"""Band of the modes that are followed, and that a default order resolves."""


class DelayedLoop(Protocol):
    """What is needed of a linear system: dx/dt = A x + b sum_k alpha_k c_k x(t - tau_k).

    `linearise.LinearSystem` is one.
    """

    @property
    def A_without_average(self) -> Floats:
        """Return (n, n) A, which holds what is not delayed."""

    @property
    def by_average(self) -> Floats:
        """Return (n,) b, dx/dt for the average."""

    @property
    def average_rows(self) -> Floats:
        """Return (members, n) c_k, what each member of the average is of the states."""

    @property
    def average_weights(self) -> Floats:
        """Return (members,) alpha_k, each member's share."""


@dataclass(frozen=True)
class Loop:
    """A loop in the coordinates x = T z, with T invertible.

    Attributes:
        H: (n, n) A, a Hessenberg matrix.
        b: first entry of b, whose others are 0.
        rows: (members, n) alpha_k c_k.
        T: (n, n).
    """

    H: Floats
    b: float
    rows: Floats
    T: Floats

    @cached_property
    def size(self) -> float:
        """Return the Frobenius norm of H."""
        return float(np.linalg.norm(self.H))

    def first_row(self, s: complex, delays_s: Floats) -> Complexes:
        """Return (n,) what all delayed signals add to the first row of H at s."""
        # einsum: a product so small waits for BLAS's threads longer than it takes.
        return np.einsum("k,kn->n", self.b * np.exp(-s * delays_s), self.rows)

    def late(self, s: complex, delays_s: Floats, v: Complexes) -> Complexes:
        """Return (members,) what arrives of each member at s, for the vector v."""
        return np.exp(-s * delays_s) * np.einsum("kn,n->k", self.rows, v)

    def solve(self, s: complex, first_row: Complexes, right: Complexes) -> Complexes:
        """Return (columns, n) the solutions of M(s) q = right for right (columns, n)."""
        tiny = float(np.finfo(float).eps) * (self.size + abs(s)) + 1e-100
        return solve_shifted(self.H, first_row, complex(s), right, tiny)


class Root(NamedTuple):
    """An eigenvalue of a loop with delays.

    Attributes:
        value: s, 1/s.
        vector: (n,) v, of length 1, in the coordinates of the `Loop`.
        residual: |M(s) v| over the norms of the parts of M(s): the relative change of the
            equations for which the eigenvalue would be exact.
    """

    value: complex
    vector: Complexes
    residual: float


def weighted_rows(linear: DelayedLoop) -> Floats:
    """Return (members, n) alpha_k c_k."""
    return linear.average_weights[:, None] * linear.average_rows


def delays_of(linear: DelayedLoop, delays_s: float | Sequence[float] | Floats) -> Floats:
    """Return (members,) the delay of each member of the average, s.

    Args:
        linear: the system.
        delays_s: one delay, or (members,) one for each member; 0, or `SHORTEST_S` to `LONGEST_S`.

    Raises:
        InputError: a delay is outside of its bounds, or their number is wrong.
    """
    members = len(linear.average_weights)
    given = np.asarray(delays_s, float)
    if given.shape not in ((), (members,)):
        raise InputError(
            f"delays_s must be one delay, or {members}, one for each member of the average "
            f"(got shape {given.shape})"
        )
    is_wrong = ~((given == 0.0) | ((given >= SHORTEST_S) & (given <= LONGEST_S)))
    if is_wrong.any():
        where = "" if given.ndim == 0 else f" for member {int(np.argmax(is_wrong))}"
        raise InputError(
            f"delays_s must be 0, or from {SHORTEST_S} to {LONGEST_S} s "
            f"(got {given[is_wrong].flat[0]}{where})"
        )
    return np.broadcast_to(given, members).copy()


def loop_of(linear: DelayedLoop) -> Loop:
    """Return a loop in the coordinates where M(s) is a Hessenberg matrix.

    They are scaled first, as LAPACK does before it computes eigenvalues: a system in its own units
    has entries from 1e-3 to 1e6.
    """
    A, b, rows = linear.A_without_average, linear.by_average, weighted_rows(linear)
    entries = np.abs(A) + np.outer(np.abs(b), np.abs(rows).sum(axis=0))
    _, (scale, _) = scipy.linalg.matrix_balance(entries, permute=False, separate=True)
    A, b, rows = A * scale / scale[:, None], b / scale, rows * scale
    first, _ = scipy.linalg.qr(b[:, None])
    # The reduction leaves the first coordinate, which is that of b, as it is.
    H, then = scipy.linalg.hessenberg(first.T @ A @ first, calc_q=True)
    Q = first @ then
    return Loop(np.triu(H, -1), float(Q[:, 0] @ b), rows @ Q, scale[:, None] * Q)


def undelayed_eigenvalues(loop: Loop) -> Complexes:
    """Return (n,) the eigenvalues of a loop without delay, 1/s."""
    matrix = loop.H.copy()
    matrix[0] += loop.b * loop.rows.sum(axis=0)
    return np.linalg.eigvals(matrix).astype(np.complex128)


@compiled
def solve_shifted(
    H: Floats, first_row: Complexes, s: complex, right: Complexes, tiny: float
) -> Complexes:
    """Return (columns, n) the solutions q of (s I - H - e_1 first_row) q = right.

    A pivot that is exactly 0 becomes `tiny`, as in LAPACK's xHSEIN: the solution is then long and
    in the direction of the null space, which is what inverse iteration is for.

    Args:
        H: (n, n) a Hessenberg matrix.
        first_row: (n,) added to its first row.
        s: the shift.
        right: (columns, n).
        tiny: the rounding error of H.
    """
    n = len(H)
    q, U = right.copy(), np.empty((n, n), np.complex128)
    row, below = -H[0] - first_row, np.empty(n, np.complex128)
    row[0] += s
    for k in range(n - 1):
        for j in range(k, n):
            below[j] = -H[k + 1, j]
        below[k + 1] += s
        if abs(below[k]) > abs(row[k]):
            row, below = below, row
            for column in q:
                column[k], column[k + 1] = column[k + 1], column[k]
        for j in range(k, n):
            U[k, j] = row[j]
        if U[k, k] == 0.0:
            U[k, k] = tiny
        factor = below[k] / U[k, k]
        for j in range(k + 1, n):
            row[j] = below[j] - factor * row[j]
        for column in q:
            column[k + 1] -= factor * column[k]
    U[n - 1, n - 1] = row[n - 1] if row[n - 1] != 0.0 else tiny
    for column in q:
        for k in range(n - 1, -1, -1):
            rest = column[k]
            for j in range(k + 1, n):
                rest -= U[k, j] * column[j]
            column[k] = rest / U[k, k]
    return q


@compiled
def missed(H: Floats, first_row: Complexes, s: complex, v: Complexes) -> Complexes:
    """Return (n,) (s I - H - e_1 first_row) v for a Hessenberg matrix H."""
    n = len(H)
    result = s * v
    for k in range(n):
        for j in range(max(k - 1, 0), n):
            result[k] -= H[k, j] * v[j]
    for j in range(n):
        result[0] -= first_row[j] * v[j]
    return result


def generic_vector(n: int) -> Complexes:
    """Return (n,) a vector of length 1 that no symmetry of a system makes miss a mode."""
    vector = np.cos(np.arange(n) ** 2 + 1.0).astype(np.complex128)
    return vector / np.linalg.norm(vector)


def refine(
    loop: Loop, delays_s: Floats, start: complex, vector: Complexes | None = None
) -> Root | None:
    """Return the root that Newton's iteration reaches from `start`, or None if it reaches none.

    Each step solves M(s) q = M'(s) v, takes q for v and s - v*v / v*q for s (nonlinear inverse
    iteration: Ruhe, SIAM J. Numer. Anal. 10, 1973). It needs no division by a characteristic
    function, so that eigenvalues of A itself, which the delay does not move, are no exception.

    Args:
        loop: the loop.
        delays_s: (members,).
        start: near the root, 1/s.
        vector: (n,) near its vector, if known.
    """
    s, last = complex(start), float(np.inf)
    v = generic_vector(len(loop.H)) if vector is None else vector
    # An unknown vector turns into the root's first; from a strange one Newton would run away.
    still = 2 if vector is None else 0
    for iteration in range(_ITERATIONS):
        if not -s.real * delays_s.max() <= _LARGEST_EXPONENT:
            return None
        slope = v + first_entry(v, loop.b * complex(delays_s @ loop.late(s, delays_s, v)))
        q = loop.solve(s, loop.first_row(s, delays_s), slope[None])[0]
        change = np.vdot(v, v) / np.vdot(v, q)
        v = q / np.linalg.norm(q)
        if iteration < still:
            continue
        s -= complex(change)
        size = float(abs(change))
        # The error after a step is of the order of the step squared, down to rounding.
        if size <= 1e-9 * max(abs(s), 1.0) or (size >= last / 2.0 and size <= 1e-6 * abs(s)):
            break
        last = size
    if not -s.real * delays_s.max() <= _LARGEST_EXPONENT:
        return None
    found = Root(s, v, residual(loop, delays_s, s, v))
    return found if found.residual <= _EXACT else None


def residual(loop: Loop, delays_s: Floats, s: complex, v: Complexes) -> float:
    """Return |M(s) v| over the norms of the parts of M(s), for v of length 1."""
    delayed = loop.first_row(s, delays_s)
    size = abs(s) + loop.size + np.linalg.norm(delayed)
    return float(np.linalg.norm(missed(loop.H, delayed, s, v)) / size)


def first_entry(like: Complexes, value: complex) -> Complexes:
    """Return a vector whose first entry is `value`, the others 0."""
    result = np.zeros_like(like)
    result[0] = value
    return result
