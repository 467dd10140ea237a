"""The modes of a large system that are asked for, without its full matrix.

`descriptor` keeps the voltages, so that everything is sparse. Around a shift, `_krylov` finds the
nearest eigenvalues and says how far all are known; `_cover` keeps account of a band until no mode
in it can be missing. Left vectors come from the transposed solution at the same shifts, as a search
of their own, which has to find the same eigenvalues.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tieline.errors import InputError, NumericalError
from tieline.linear._cover import Cells
from tieline.linear._descriptor import Descriptor, descriptor
from tieline.linear._krylov import Disc, search
from tieline.linear.modes import Modes, modes_of

__all__ = ["Descriptor", "descriptor", "least_damped", "modes_near"]

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

BLOCKS = (2, 8, 32)
"""Start vectors of a search, and of the next where too many eigenvalues lie together."""

SPACE, SPACE_BY_BLOCK = 80, 8
"""Size of the largest search space, and how much more for each start vector."""

SMALL = 400
"""Up to so many states a system is solved densely: a search space would hardly be smaller."""

GROWTH = 0.05
"""Modes that grow faster than with this negative damping ratio are not looked for."""

DAMPED = 0.3
"""Nor are modes above this damping ratio, if not told otherwise."""

FIRST_STAGE = 0.05
"""Damping ratio up to which the band is searched first; it is doubled until nothing is missing."""

ENOUGH_OF_BAND, ENOUGH_OF_WIDTH = 1 / 16, 1.5
"""A search stops at a radius of this part of the band, and of half the width to be known."""

REAL = 1e-9
"""Negative imaginary part, relative to the size, that is rounding."""

MARGIN = 1e-6
"""Part of a radius within which two searches need not agree."""


def modes_near(of: Descriptor, shift: complex, count: int) -> Modes:
    """Return the `count` modes nearest to a shift, with both vectors.

    Args:
        of: the system.
        shift: where to look, 1/s, with an imaginary part of 0 or more.
        count: how many; of a complex pair only the one with positive imaginary part is counted.

    Raises:
        InputError: the imaginary part is negative, or the system has not so many modes.
        NumericalError: the shift is an eigenvalue, or the modes around it cannot be told apart.
    """
    if shift.imag < 0:
        raise InputError(f"a shift must have an imaginary part >= 0 (got {shift:.6g})")
    if not 1 <= count <= of.states // 2:
        raise InputError(f"count must be >= 1 and <= {of.states // 2}, half the states ({count=})")
    # So many modes would ask for a search space of the size of the system.
    if of.states <= max(SMALL, 4 * count):
        dense = modes_of(of.linear)
        return _picked(dense, np.argsort(np.abs(dense.eigenvalues - shift))[:count])
    solve = of.inverse(shift)
    for block in BLOCKS:
        size = min(SPACE + 4 * count + SPACE_BY_BLOCK * block, of.states - 2 * block)
        disc = search(solve, of.states, shift, block, size, lambda _, s: _upper(s).sum() >= count)
        known = disc.values[_upper(disc.values)]
        if len(known) >= count:
            return _joined(of, [_both_sides(of, disc, block, known[:count])])
    raise NumericalError(f"only {len(known)} of {count} modes near {shift:.6g} 1/s are told apart")


def least_damped(
    of: Descriptor,
    band_hz: tuple[float, float] = (0.1, 1.0),
    count: int = 20,
    damping_ratio: float = DAMPED,
) -> Modes:
    """Return the `count` modes of least damping ratio within a band, with both vectors.

    None is missing: of the part of the plane between the band's ends, from the damping ratio
    -`GROWTH` up to that of the last mode returned, every point lies in a disc in which all
    eigenvalues are known (`_krylov` says when), and where discs overlap they agree.

    Args:
        of: the system.
        band_hz: lowest and highest frequency, Hz.
        count: how many modes; fewer are returned if there are no more.
        damping_ratio: modes damped more are not looked for.

    Raises:
        InputError: an argument is outside what makes sense.
        NumericalError: searches disagree, or modes lie too close together to be told apart.
    """
    low, high = band_hz
    if not (0 < low < high and count >= 1 and 0 < damping_ratio < 1):
        raise InputError(
            "least_damped needs 0 < lowest < highest frequency, count >= 1 and a damping ratio "
            f"> 0 and < 1 (got {band_hz=}, {count=}, {damping_ratio=})"
        )
    if of.states <= SMALL:
        dense = modes_of(of.linear)
        return _picked(dense, _least(dense.eigenvalues, band_hz, count, damping_ratio))
    band = _Band(of, band_hz, count, damping_ratio)
    band.run()
    return band.modes()


class _Band:
    """A search of a band: the discs that are known, with their blocks, and what lies in them."""

    def __init__(
        self, of: Descriptor, band_hz: tuple[float, float], count: int, damping_ratio: float
    ) -> None:
        self.of, self.band_hz, self.count, self.damping_ratio = of, band_hz, count, damping_ratio
        self.low, self.high = 2.0 * np.pi * band_hz[0], 2.0 * np.pi * band_hz[1]
        self.cells = Cells((self.low, self.high), damping_ratio, GROWTH)
        self.discs: list[tuple[Disc, int]] = []
        self.found = np.zeros(0, np.complex128)

    def chosen(self) -> Complexes:
        """Return the least damped of what has been found."""
        return self.found[_least(self.found, self.band_hz, self.count, self.damping_ratio)]

    def bound(self) -> float:
        """Return the damping ratio above which no mode matters any more."""
        chosen = self.chosen()
        return float(_damping(chosen).max()) if len(chosen) == self.count else self.damping_ratio

    def run(self) -> None:
        """Search until all that matters is known, what is little damped first."""
        stage, level = FIRST_STAGE, 0
        while True:
            shift = self.cells.next_shift(min(stage, self.bound()))
            if shift is not None:
                level = 0 if self._look(shift, BLOCKS[level]) else level + 1
                if level == len(BLOCKS):
                    raise NumericalError(f"modes lie too close together near {shift:.6g} 1/s")
            elif stage >= self.bound():
                return
            else:
                stage *= 2.0

    def _look(self, shift: complex, block: int) -> bool:
        """Search around a shift; return whether that has made anything known."""
        of, wide = self.of, (self.high - self.low) * ENOUGH_OF_BAND
        wide = max(wide, ENOUGH_OF_WIDTH * self.cells.half_width(shift, self.bound()))
        size = SPACE + SPACE_BY_BLOCK * block
        solve = of.inverse(shift)
        disc = search(solve, of.states, shift, block, size, lambda radius, _: radius >= wide)
        is_new = np.ones(len(disc.values), dtype=bool)
        for other, _ in self.discs:
            _require_agreement(disc, other)
            is_new &= ~other.holds(disc.values)
        self.discs.append((disc, block))
        self.found = np.concatenate([self.found, disc.values[is_new]])
        return self.cells.learn(shift, disc.radius)

    def modes(self) -> Modes:
        """Return the modes that were looked for, each from a disc that holds many of them."""
        left, parts = self.chosen(), []
        while len(left):
            disc, block = max(self.discs, key=lambda item: int(item[0].holds(left).sum()))
            held = disc.holds(left)
            parts.append(_both_sides(self.of, disc, block, left[held]))
            left = left[~held]
        return _joined(self.of, parts)


Sides = tuple[Complexes, Complexes, Complexes]
"""Eigenvalues (k,), right vectors (n, k), and rows (k, n) that are 1 with their own, else 0."""


def _both_sides(of: Descriptor, disc: Disc, block: int, wanted: Complexes) -> Sides:
    """Return eigenvalues of a disc with both vectors.

    Raises:
        NumericalError: the transposed system's eigenvalues are not the same.
    """
    shift, reach = disc.shift, float(np.abs(wanted - disc.shift).max()) * (1.0 + MARGIN)
    transposed, size = of.inverse(shift, transposed=True), 2 * (SPACE + SPACE_BY_BLOCK * block)
    size = min(max(size, 4 * len(disc.values)), of.states - 2 * block)
    other = search(transposed, of.states, shift, block, size, lambda radius, _: radius >= reach)
    ahead = np.abs(disc.values - shift)
    ends = np.array([reach, *ahead[ahead > reach], disc.radius])
    ends = ends[ends <= other.radius]
    widest = int(np.argmax(np.diff(ends))) if len(ends) > 1 else 0
    both = float(ends[widest : widest + 2].mean()) if len(ends) else 0.0
    right = disc.vectors[:, ahead < both]
    left = other.vectors[:, np.abs(other.values - shift) < both].T
    if right.shape != left.T.shape or other.radius < reach:
        raise NumericalError(
            f"the system and its transpose disagree around {shift:.6g} 1/s "
            f"({right.shape[1]} and {len(left)} modes)"
        )
    # Oblique projection: what either side lacks enters the eigenvalues only as a product.
    left = np.asarray(np.linalg.solve(left @ right, left), np.complex128)
    inverse, mix = np.linalg.eig(left @ of.inverse(shift)(right))
    right = np.asarray(right @ mix, np.complex128)
    left = np.asarray(np.linalg.solve(mix, left), np.complex128)
    values = shift + 1.0 / inverse
    scale = of.scale[: of.states, None]
    length = np.linalg.norm(scale * right, axis=0)
    right = np.asarray(scale * right / length, np.complex128)
    left = np.asarray(left / scale.T * length[:, None], np.complex128)
    _, own = linear_sum_assignment(np.abs(wanted[:, None] - values))
    return values[own], right[:, own], left[own]


def _joined(of: Descriptor, parts: Sequence[Sides]) -> Modes:
    """Return the modes of several discs, in ascending order of frequency."""
    if not parts:
        nothing = np.zeros((of.states, 0), np.complex128)
        return Modes(of.linear, np.zeros(0, np.complex128), nothing, nothing)
    values = np.concatenate([part[0] for part in parts])
    right = np.concatenate([part[1] for part in parts], axis=1)
    left = np.concatenate([part[2] for part in parts]).conj().T
    return _picked(Modes(of.linear, values, right, left), np.arange(len(values)))


def _picked(modes: Modes, places: NDArray[np.int64]) -> Modes:
    """Return some of the modes, in ascending order of frequency."""
    s = modes.eigenvalues[places]
    places = places[np.lexsort((s.real, s.imag))]
    return Modes(
        modes.linear, modes.eigenvalues[places], modes.right[:, places], modes.left[:, places]
    )


def _least(
    s: Complexes, band_hz: tuple[float, float], count: int, damping_ratio: float
) -> NDArray[np.int64]:
    """Return the places of the `count` least damped eigenvalues of a band."""
    f_hz = s.imag / (2.0 * np.pi)
    fits = (f_hz >= band_hz[0]) & (f_hz <= band_hz[1]) & (_damping(s) <= damping_ratio)
    places = np.flatnonzero(fits)
    return places[np.argsort(_damping(s[places]), kind="stable")[:count]]


def _damping(s: Complexes) -> Floats:
    return -s.real / np.maximum(np.abs(s), np.finfo(np.float64).tiny)


def _upper(s: Complexes) -> NDArray[np.bool_]:
    """Return which eigenvalues are real, or of a pair the one of positive imaginary part."""
    upper: NDArray[np.bool_] = s.imag >= -REAL * np.abs(s)
    return upper


def _require_agreement(one: Disc, other: Disc) -> None:
    """Raise unless two discs hold the same eigenvalues where they overlap.

    Raises:
        NumericalError: one holds more of them.
    """
    counts = [
        np.count_nonzero(
            (np.abs(disc.values - one.shift) < one.radius * (1.0 - MARGIN))
            & (np.abs(disc.values - other.shift) < other.radius * (1.0 - MARGIN))
        )
        for disc in (one, other)
    ]
    if counts[0] != counts[1]:
        raise NumericalError(
            f"searches around {one.shift:.6g} and {other.shift:.6g} 1/s find {counts[0]} and "
            f"{counts[1]} modes where they overlap"
        )
