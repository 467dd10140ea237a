"""Modes of a loop, followed while its delays grow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError, NumericalError
from tieline.linear._delay_roots import (
    CONFIRMED,
    HIGHEST_HZ,
    LOWEST_HZ,
    DelayedLoop,
    Loop,
    Root,
    delays_of,
    first_entry,
    loop_of,
    refine,
    undelayed_eigenvalues,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_SHORTEST_STEP = 2.0**-20
"""Part of the way between two delays below which a path counts as lost."""

_IMMUNE = 1e-10
"""Relative move of a mode that takes no part in the average. Its vector is not looked at: modes of
equal eigenvalues, as PMU filters have them, exchange theirs at will."""


@dataclass(frozen=True)
class DampingAgainstDelay:
    """Modes at growing delays.

    Attributes:
        delays_s: (points,) or (points, members), as given.
        undelayed: (modes,) eigenvalues without delay, 1/s.
        eigenvalues: (points, modes) at each point, 1/s. NaN from where on a mode could not be told
            from another that it met, as `is_lost` says.
    """

    delays_s: Floats
    undelayed: Complexes
    eigenvalues: Complexes

    @property
    def is_lost(self) -> NDArray[np.bool_]:
        """Return (points, modes) whether a mode was lost before or at a point."""
        return np.isnan(self.eigenvalues)

    @property
    def damping_ratio(self) -> Floats:
        """Return (points, modes) the damping ratios, negative where a mode grows."""
        return -self.eigenvalues.real / np.abs(self.eigenvalues)

    @property
    def f_hz(self) -> Floats:
        """Return (points, modes) the frequencies of oscillation."""
        return self.eigenvalues.imag / (2.0 * np.pi)


def mode_with_delay(
    linear: DelayedLoop, start: complex, delays_s: Sequence[float] | Floats
) -> Complexes:
    """Return (points,) what one mode of the undelayed loop becomes, 1/s, followed point by point.

    Args:
        linear: the system.
        start: the eigenvalue without delay, 1/s, to 0.1 %.
        delays_s: (points,) delays of all sensors, or (points, members) one for each member. The way
            leads from zero to the first and from each straight to the next.

    Raises:
        InputError: the undelayed loop has no such mode, or the delays are wrong.
        NumericalError: the mode meets another one, beyond which it cannot be followed.
    """
    points = _points(linear, delays_s)
    loop = loop_of(linear)
    root = _undelayed(loop, undelayed_eigenvalues(loop), start)
    here = np.zeros(len(loop.rows))
    path = []
    for there in points:
        root, here = _follow(loop, root, here, there), there
        path.append(root.value)
    return np.array(path, np.complex128)


def damping_against_delay(
    linear: DelayedLoop,
    delays_s: Sequence[float] | Floats,
    modes: Sequence[complex] | Complexes | None = None,
) -> DampingAgainstDelay:
    """Return modes of the undelayed loop, followed through growing delays.

    Args:
        linear: the system.
        delays_s: (points,) or (points, members), as for `mode_with_delay`.
        modes: (modes,) eigenvalues without delay, 1/s; by default all from `LOWEST_HZ` to
            `HIGHEST_HZ`.

    Raises:
        InputError: the undelayed loop has no such mode, or the delays are wrong.
    """
    points = _points(linear, delays_s)
    loop = loop_of(linear)
    values = undelayed_eigenvalues(loop)
    if modes is None:
        f_hz = values.imag / (2.0 * np.pi)
        modes = values[(f_hz >= LOWEST_HZ) & (f_hz <= HIGHEST_HZ)]
        modes = modes[np.argsort(modes.imag)]
    roots = [_undelayed(loop, values, mode) for mode in modes]
    eigenvalues = np.full((len(points), len(roots)), np.nan, np.complex128)
    for column, root in enumerate(roots):
        here = np.zeros(len(loop.rows))
        for row, there in enumerate(points):
            try:
                root, here = _follow(loop, root, here, there), there
            except NumericalError:
                break
            eigenvalues[row, column] = root.value
    undelayed = np.array([root.value for root in roots], np.complex128)
    return DampingAgainstDelay(np.asarray(delays_s, float), undelayed, eigenvalues)


def _follow(loop: Loop, root: Root, start_s: Floats, end_s: Floats) -> Root:
    """Return what a root becomes while the delays go straight from one set to another.

    A step goes along the tangent and is corrected by `refine`. It is halved where the corrected
    root does not lie where the tangents at both ends of the step say, or where its vector turned
    away: that is another mode.

    Args:
        loop: the loop.
        root: the root at `start_s`.
        start_s: (members,) delays.
        end_s: (members,) delays.

    Raises:
        NumericalError: the root meets another one on its way (two that meet on the real axis, for
            instance), beyond which neither can be told from the other.
    """
    way = end_s - start_s
    done, step = 0.0, 1.0
    slope = _tangent(loop, root, start_s, way)
    while done < 1.0:
        step = min(step, 1.0 - done)
        there = start_s + (done + step) * way
        reached = refine(loop, there, root.value + step * slope, root.vector)
        if reached is not None:
            ahead = _tangent(loop, reached, there, way)
            if _is_same(root, reached, step * slope, step * ahead):
                root, slope, done, step = reached, ahead, done + step, 2.0 * step
                continue
        step /= 2.0
        if step < _SHORTEST_STEP:
            raise NumericalError(
                f"the mode at {root.value:.4g} 1/s cannot be followed beyond the delays "
                f"{np.unique(start_s + done * way).round(6).tolist()} s: it meets another one there"
            )
    return root


def _is_same(root: Root, reached: Root, move: complex, move_back: complex) -> bool:
    """Return whether two roots lie on one path, by the moves that the tangents at both promise."""
    moved = reached.value - root.value
    size = max(abs(root.value), 1.0)
    if max(abs(moved), abs(move)) <= _IMMUNE * size:
        return True
    is_on_path = abs(moved - 0.5 * (move + move_back)) <= 0.1 * abs(moved) + 1e-9 * size
    turned = abs(np.vdot(root.vector, reached.vector))
    return bool(is_on_path and abs(moved) <= 0.2 * size and turned >= 0.9)


def _tangent(loop: Loop, root: Root, delays_s: Floats, way: Floats) -> complex:
    """Return ds of a root for a small part of a way of the delays.

    With w the left vector, ds = -w (dM) v / w M' v; M q = r turns every r to w r times v, as M is
    singular, so that the two solutions' ratio is the fraction.
    """
    s, v = root.value, root.vector
    late = loop.late(s, delays_s, v)
    by_s = v + first_entry(v, loop.b * complex(delays_s @ late))
    by_delay = first_entry(v, loop.b * s * complex(way @ late))
    if not by_delay.any():
        return 0j
    q = loop.solve(s, loop.first_row(s, delays_s), np.stack([by_s, by_delay]))
    return complex(-np.vdot(v, q[1]) / np.vdot(v, q[0]))


def _undelayed(loop: Loop, values: Complexes, start: complex) -> Root:
    """Return the root without delay that stands at `start`, among the eigenvalues (n,)."""
    nearest = complex(values[np.argmin(np.abs(values - start))])
    root = refine(loop, np.zeros(len(loop.rows)), nearest)
    if abs(nearest - start) > CONFIRMED * max(abs(start), 1.0) or root is None:
        raise InputError(
            f"the loop without delay has no mode at {start} 1/s (the nearest is {nearest:.6g})"
        )
    return root


def _points(linear: DelayedLoop, delays_s: Sequence[float] | Floats) -> Floats:
    points = np.asarray(delays_s, float)
    if points.ndim not in (1, 2) or len(points) == 0:
        raise InputError(
            f"delays_s must be a list of delays, or of one for each member "
            f"(got shape {points.shape})"
        )
    return np.stack([delays_of(linear, point) for point in points])
