"""The eigenvalues around a shift, and the disc in which all of them are known.

Arnoldi's method on (A - shift)^-1, whose eigenvalues 1 / (lambda - shift) are the larger the nearer
lambda is; with a block of start vectors, so that repeated eigenvalues are seen, and without
restarts (Ruhe's banded form; Saad, Numerical Methods for Large Eigenvalue Problems, 2nd ed., 2011,
section 6.5). ARPACK is asked for a number of eigenvalues and returns when it has them, which takes
it thousands of solutions where that number cuts through a crowd; here the crowd ends the disc.

The rule that says what is known. A Ritz value theta has converged when its residual is below
`TOLERANCE` of its size. If not, it leaves everything unknown whose inverse is not larger than
|theta| plus that residual, and `SLACK` of that for the sensitivity of eigenvalues, which a balanced
matrix keeps low. The disc ends before the first such value, and what lies inside has converged.
Where as many values coincide as the block has columns, there may be more of them: the disc ends
before.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Solve = Callable[[Complexes], Complexes]
"""Returns (A - shift)^-1 times columns (n, k)."""

TOLERANCE = 1e-9
"""Residual of a converged Ritz value, relative to it."""

SLACK = 0.03
"""Part by which what has not converged may be nearer than its residual says."""

COINCIDE = 1e-6
"""Distance of eigenvalues that are taken for equal, relative to their distance from the shift."""

ORTHOGONAL = 0.5**0.5
"""A vector that a projection leaves longer than this part is orthogonal to rounding (Daniel, Gragg,
Kaufman and Stewart, Mathematics of Computation 30, 1976)."""

FIRST_CHECK, CHECK_EVERY = 48, 16
"""Sizes of the search space at which it is looked at."""

_START = 20


@dataclass(frozen=True)
class Disc:
    """What a search has found.

    Attributes:
        shift: its centre, 1/s; radius: how far all eigenvalues are known, 1/s.
        values: (k,) the eigenvalues inside, nearest first.
        vectors: (n, k) their eigenvectors, of length 1.
    """

    shift: complex
    radius: float
    values: Complexes
    vectors: Complexes

    def holds(self, s: Complexes) -> NDArray[np.bool_]:
        """Return whether points lie inside."""
        return np.abs(s - self.shift) < self.radius


def search(
    solve: Solve,
    states: int,
    shift: complex,
    block: int,
    largest: int,
    is_enough: Callable[[float, Complexes], bool],
) -> Disc:
    """Return the disc around a shift that is known once it is enough, or at the largest space.

    Args:
        solve: solves for (A - shift).
        states: n, well above `largest`.
        shift: where to search, 1/s.
        block: how many start vectors.
        largest: size of the search space at which to stop.
        is_enough: told the radius and the eigenvalues inside, whether to stop.
    """
    space = _Space(solve, states, block, largest)
    while True:
        space.extend(FIRST_CHECK if not space.size else space.size + CHECK_EVERY)
        inverse, weights, reach = space.known()
        values = shift + 1.0 / inverse
        radius = np.inf if reach == 0.0 else 1.0 / reach
        if space.size >= largest or is_enough(radius, values):
            vectors = space.basis[:, : space.size] @ weights
            return Disc(shift, radius, values, vectors / np.linalg.norm(vectors, axis=0))


class _Space:
    """A growing Krylov space: `basis` (n, size + block) and the operator in it, `projected`."""

    def __init__(self, solve: Solve, states: int, block: int, largest: int) -> None:
        room = largest + CHECK_EVERY + 2 * block
        self.solve, self.block, self.size = solve, block, 0
        self.basis = np.zeros((states, room), np.complex128, order="F")
        self.projected = np.zeros((room, room), np.complex128)
        # Any start will do that no eigenvector is orthogonal to; the same one for equal results.
        start = np.random.default_rng(_START).standard_normal((states, block))
        self.basis[:, :block] = np.linalg.qr(start)[0]

    def extend(self, size: int) -> None:
        """Grow to at least a size, block by block."""
        while self.size < size:
            images = self.solve(self.basis[:, self.size : self.size + self.block])
            for image in images.T:
                self._append(np.ascontiguousarray(image))

    def _append(self, image: Complexes) -> None:
        end = self.size + self.block
        basis, column = self.basis[:, :end], self.projected[:, self.size]
        length, left = np.inf, float(np.linalg.norm(image))
        # Again where much was taken away; twice is enough to be orthogonal to rounding.
        while left < ORTHOGONAL * length:
            share = (image.conj() @ basis).conj()
            image = image - basis @ share
            column[:end] += share
            length, left = left, float(np.linalg.norm(image))
        column[end] = left
        self.basis[:, end] = image / left
        self.size += 1

    def known(self) -> tuple[Complexes, Complexes, float]:
        """Return (k,) converged eigenvalues, largest first, (size, k) weights, and where they end.

        They end at the size of the largest that may still be unknown; 0 if there is none.
        """
        size, block = self.size, self.block
        theta, weights = np.linalg.eig(self.projected[:size, :size])
        residual = np.linalg.norm(self.projected[size : size + block, :size] @ weights, axis=0)
        is_known = (residual < TOLERANCE * np.abs(theta)) & ~_crowded(theta, block)
        reach = float((np.abs(theta) + residual)[~is_known].max(initial=0.0)) * (1.0 + SLACK)
        inside = np.flatnonzero(is_known & (np.abs(theta) > reach))
        order = inside[np.argsort(-np.abs(theta[inside]))]
        return theta[order], weights[:, order], reach


def _crowded(theta: Complexes, block: int) -> NDArray[np.bool_]:
    """Return which values coincide with so many others that there may be more of them."""
    distance = np.abs(theta[:, None] - theta)
    together: NDArray[np.int64] = (distance <= COINCIDE * np.abs(theta)).sum(axis=1)
    return together >= block
