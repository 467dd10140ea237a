"""Follows modes along a path of systems by continuation, also where they become over-damped.

What is followed is an invariant subspace with its projector P = X Y^T: the pair of an oscillation
or, where that meets on the real axis and parts, the slower of its two real eigenvalues, which is
what is left of the mode when the faster one joins another. The share of mode k of a new system in
it is l_k^H P r_k; over all modes the shares sum to the dimension of the subspace. The mode that
holds nearly all of it is the same mode. Where none does, the step is halved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tieline.errors import NumericalError
from tieline.linear.modes import OSCILLATES_RAD_S, Modes

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

SAME = 0.85
"""Part of the old subspace that a new mode must hold to be taken for the same."""

WORST_CONDITION = 1e6
"""Condition number of an eigenvalue above which its vectors are not looked at."""

LEAST_STEP = 1e-4
"""Smallest step, as a part of the whole path, before a mode counts as lost."""


@dataclass(frozen=True)
class Track:
    """One mode along a path.

    Attributes:
        values: (points,) of the parameter.
        eigenvalues: (points,) 1/s, with imaginary part >= 0; real where it is over-damped.
    """

    values: Floats
    eigenvalues: Complexes

    @property
    def frequency_hz(self) -> Floats:
        """Return (points,) the frequency, 0 where the mode is over-damped."""
        return self.eigenvalues.imag / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> Floats:
        """Return (points,) the damping ratio, 1 where the mode is over-damped."""
        return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues), np.float64)

    @property
    def length(self) -> float:
        """Return how far the mode wanders in the complex plane, 1/s."""
        return float(np.abs(np.diff(self.eigenvalues)).sum())


class _Subspace:
    """What is followed: X (n, d) and Y (n, d) with Y^T X = 1, of one real mode or of a pair."""

    def __init__(self, modes: Modes, place: int) -> None:
        right, left = modes.right[:, place], modes.left[:, place]
        self.eigenvalue = complex(modes.eigenvalues[place])
        if self.eigenvalue.imag > OSCILLATES_RAD_S:
            self.X = np.column_stack([right.real, right.imag])
            Y = np.column_stack([left.real, left.imag])
        else:
            self.eigenvalue = complex(self.eigenvalue.real)
            self.X, Y = right.real[:, None], left.real[:, None]
        self.Y = Y @ np.linalg.inv(self.X.T @ Y)

    def found_in(self, modes: Modes) -> "_Subspace | None":
        """Return the same mode in another system, None where no mode is clearly it."""
        dimension = self.X.shape[1]
        shares = np.real(
            np.einsum("km,km->m", (modes.left.conj().T @ self.X).T, self.Y.T @ modes.right)
        )
        sizes = np.linalg.norm(modes.left, axis=0) * np.linalg.norm(modes.right, axis=0)
        # Of modes that all but coincide, as the poles of equal lead-lags, vectors mean nothing.
        shares = np.where(sizes < WORST_CONDITION, shares, 0.0) / dimension
        oscillates = modes.eigenvalues.imag > OSCILLATES_RAD_S
        shares[oscillates] *= 2.0
        best = int(np.argmax(shares))
        if shares[best] > SAME:
            return _Subspace(modes, best)
        real = np.flatnonzero(~oscillates)
        both = real[np.argsort(-shares[real])[:2]]
        if dimension == 2 and len(both) == 2 and shares[both].sum() > SAME:
            slower = both[np.argmin(np.abs(modes.eigenvalues[both]))]
            return _Subspace(modes, int(slower))
        return None


def follow(
    modes_at: Callable[[float], Modes], values: Sequence[float], starts: Sequence[int]
) -> list[Track]:
    """Return the tracks of some modes along a path.

    Args:
        modes_at: gives the modes at a value of the parameter; asked between the values, too, where
            a step is too long to tell the modes apart.
        values: (points,) of the parameter, ascending or descending.
        starts: places of oscillating modes in `modes_at(values[0])`.

    Raises:
        NumericalError: a mode cannot be told from its neighbours however small the step.
    """
    known = {values[0]: modes_at(values[0])}

    def at(value: float) -> Modes:
        if value not in known:
            known[value] = modes_at(value)
        return known[value]

    followed = [_Subspace(known[values[0]], start) for start in starts]
    paths = [[subspace.eigenvalue] for subspace in followed]
    least = LEAST_STEP * abs(values[-1] - values[0])
    for before, value in pairwise(values):
        for i, subspace in enumerate(followed):
            followed[i] = _followed(subspace, at, before, value, least)
            paths[i].append(followed[i].eigenvalue)
        # Vectors of a large system are large: those of the stretch that is done can go.
        known = {value: known[value]}
    return [Track(np.array(values, np.float64), np.array(path)) for path in paths]


def _followed(
    subspace: _Subspace, at: Callable[[float], Modes], before: float, value: float, least: float
) -> _Subspace:
    here, there = before, value
    while here != value:
        found = subspace.found_in(at(there))
        if found is not None:
            subspace, here, there = found, there, value
            continue
        there = 0.5 * (here + there)
        if abs(there - here) < least:
            raise NumericalError(
                f"the mode at {subspace.eigenvalue:.4f} 1/s cannot be told from its neighbours "
                f"beyond {here:g}; its eigenvalue may be a multiple one there"
            )
    return subspace
