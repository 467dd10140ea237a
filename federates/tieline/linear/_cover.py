"""Which part of a band of the complex plane is known, in square cells.

The region to be known lies between two frequencies, and in damping ratio between growth and a
bound that falls as modes are found. It is cut into cells; a cell is known when it lies wholly in
the disc of a search, and matters when any point of it is damped less than the bound.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

ROWS = 160
"""Rows of cells in the band; a disc loses half a cell's diagonal of its radius to them."""

CANDIDATES, SAMPLE = 200, 1000
"""How many unknown cells are tried for the next shift, and on how many it is judged."""

EXPECTED = 10
"""Part of the band that the first disc is expected to reach."""


class Cells:
    """The cells of a band and what is known of them.

    Attributes:
        centre: (rows, columns) centres, 1/s, rows in ascending frequency.
        half_diagonal: of a cell, 1/s.
        damping_ratio: (rows, columns) the least damping ratio in each, 0 for a growing one.
        is_known: (rows, columns) whether a disc holds it, or it lies beyond growth.
    """

    def __init__(self, band_rad_s: tuple[float, float], damping: float, growth: float) -> None:
        low, high = band_rad_s
        side = (high - low) / ROWS
        left = int(np.ceil(high * _slope(damping) / side))
        right = int(np.ceil(high * _slope(growth) / side))
        x = side * (np.arange(-left, right) + 0.5)
        y = low + side * (np.arange(ROWS) + 0.5)
        self.centre = x + 1j * y[:, None]
        self.half_diagonal = side / np.sqrt(2.0)
        corner = self.centre + (0.5 + 0.5j) * side
        self.damping_ratio = np.where(corner.real < 0, -corner.real / np.abs(corner), 0.0)
        self.shifts, self.radii = [complex(0.0, 0.5 * (low + high))], [(high - low) / EXPECTED]
        self.is_known = self.centre.real - 0.5 * side > _slope(growth) * corner.imag

    def learn(self, shift: complex, radius: float) -> bool:
        """Note what a disc holds; return whether that is news."""
        self.shifts.append(shift)
        self.radii.append(radius)
        held = np.abs(self.centre - shift) + self.half_diagonal <= radius
        is_news = bool((held & ~self.is_known).any())
        self.is_known = self.is_known | held
        return is_news

    def next_shift(self, bound: float) -> complex | None:
        """Return where to search next, None when all that matters is known.

        It is the unknown cell around which a disc as large as that of the nearest search would
        hold most of the unknown cells.
        """
        unknown = self.centre[(self.damping_ratio <= bound) & ~self.is_known]
        if not len(unknown):
            return None
        candidates = unknown[:: 1 + len(unknown) // CANDIDATES]
        nearest = np.argmin(np.abs(candidates[:, None] - np.array(self.shifts)), axis=1)
        reach = np.array(self.radii)[nearest]
        sample = unknown[:: 1 + len(unknown) // SAMPLE]
        held = np.abs(candidates[:, None] - sample) <= reach[:, None]
        return complex(candidates[np.argmax(held.sum(axis=1))])

    def half_width(self, shift: complex, bound: float) -> float:
        """Return half of how far the region reaches from left to right at a shift, 1/s."""
        row = int(np.argmin(np.abs(self.centre[:, 0].imag - shift.imag)))
        x = self.centre[row, self.damping_ratio[row] <= bound].real
        return float(0.5 * (x[-1] - x[0]))


def _slope(damping_ratio: float) -> float:
    """Return -Re / Im of the points of a damping ratio."""
    return damping_ratio / np.sqrt(1.0 - damping_ratio**2)
