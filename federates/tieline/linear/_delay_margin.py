"""Uniform delays at which a mode of a loop stands on the imaginary axis, without a search."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError, NumericalError
from tieline.linear._delay_roots import (
    LONGEST_S,
    DelayedLoop,
    Loop,
    loop_of,
    refine,
    undelayed_eigenvalues,
)

Floats = NDArray[np.float64]

SLOWEST_HZ = 1e-4
"""Crossings at lower frequencies are not looked for: the angles' common reference is an eigenvalue
0 at any delay, and takes several digits from what stands beside it."""

_NEAR_AXIS = 1e-3
"""Real over imaginary part up to which an eigenvalue of the Hamiltonian is tried as a crossing; it
only has to be wide enough, as every one that is tried is then solved for."""

STANDS_STILL = 1e-5
"""Real part, 1/s, up to which an eigenvalue counts as on the imaginary axis: the reference of all
angles is an eigenvalue 0, of which rounding leaves 1e-7 where another one lies near."""


class Crossing(NamedTuple):
    """A delay at which a mode crosses the imaginary axis.

    Attributes:
        delay_s: of every sensor.
        f_hz: of the oscillation there.
        destabilises: the mode goes to the right while the delay grows.
    """

    delay_s: float
    f_hz: float
    destabilises: bool


@dataclass(frozen=True)
class DelayMargin:
    """The smallest delay of all sensors at which the loop is no longer stable.

    Attributes:
        delay_s: the delay; 0 if the loop is unstable without any.
        f_hz: of the oscillation that neither grows nor decays there; without delay, that of the
            eigenvalue that grows fastest.
        unstable_without_delay: eigenvalues of the undelayed loop that grow, 1/s, of a pair the one
            with positive imaginary part; the fastest first.
    """

    delay_s: float
    f_hz: float
    unstable_without_delay: tuple[complex, ...]

    @property
    def is_stable_without_delay(self) -> bool:
        """Whether the loop is stable when nothing is delayed."""
        return not self.unstable_without_delay


def delay_crossings(linear: DelayedLoop, longest_s: float = LONGEST_S) -> tuple[Crossing, ...]:
    """Return every delay of all sensors at which a mode crosses the imaginary axis, ascending.

    Args:
        linear: the system.
        longest_s: up to which delay to look, s.

    Raises:
        InputError: `longest_s` is not above 0, or above `LONGEST_S`.
    """
    if not 0.0 < longest_s <= LONGEST_S:
        raise InputError(f"longest_s must be > 0 and <= {LONGEST_S} s (got {longest_s})")
    return tuple(_crossings(loop_of(linear), longest_s))


def delay_margin(linear: DelayedLoop, longest_s: float = LONGEST_S) -> DelayMargin | None:
    """Return the delay margin of the loop, or None if it is stable for all delays to `longest_s`.

    Args:
        linear: the system.
        longest_s: up to which delay to look, s.

    Raises:
        InputError: `longest_s` is not above 0, or above `LONGEST_S`.
        NumericalError: the crossing that was found is no eigenvalue of the loop at that delay.
    """
    found = delay_crossings(linear, longest_s)
    loop = loop_of(linear)
    values = undelayed_eigenvalues(loop)
    growing = values[(values.real > STANDS_STILL) & (values.imag >= 0.0)]
    growing = growing[np.argsort(-growing.real)]
    if len(growing):
        unstable = tuple(complex(value) for value in growing)
        return DelayMargin(0.0, unstable[0].imag / (2.0 * np.pi), unstable)
    if not found:
        return None
    first = found[0]
    if first.delay_s > 0.0 and not first.destabilises:
        raise NumericalError(
            f"a mode comes from the right at {first.delay_s:.6g} s and {first.f_hz:.6g} Hz, but "
            f"none was found to go there before"
        )
    on_axis = 2j * np.pi * first.f_hz
    root = refine(loop, np.full(len(loop.rows), first.delay_s), on_axis)
    if root is None or abs(root.value - on_axis) > STANDS_STILL:
        raise NumericalError(
            f"the crossing at {first.delay_s:.6g} s and {first.f_hz:.6g} Hz is not confirmed by an "
            f"eigenvalue there (reached: {None if root is None else root.value})"
        )
    return DelayMargin(first.delay_s, first.f_hz, ())


def _crossings(loop: Loop, longest_s: float) -> list[Crossing]:
    """Return all crossings for one delay of all sensors up to `longest_s`, the shortest first.

    With h(s) = c (s I - A)^-1 b the characteristic equation is h(s) exp(-s tau) = 1. On the
    imaginary axis |h(j w)| = 1, whatever tau is; each such w crosses at tau = (arg h + 2 pi m) / w,
    always in one direction: to the right if |h| falls with growing w (Cooke and van den Driessche,
    Funkcialaj Ekvacioj 29, 1986).
    """
    found = []
    for w in unit_gains(loop):
        h, slope = _gain(loop, w)
        angle = np.angle(h) % (2.0 * np.pi)
        # A mode on the axis without delay: rounding must not make a whole turn of it.
        first_s = angle / w if 2.0 * np.pi - angle > 1e-9 else 0.0
        times = np.arange(first_s, longest_s, 2.0 * np.pi / w)
        found += [Crossing(float(t), float(w / (2.0 * np.pi)), bool(slope < 0.0)) for t in times]
    return sorted(found)


def unit_gains(loop: Loop) -> list[float]:
    """Return all w, rad/s, above `SLOWEST_HZ` with |h(j w)| = 1, ascending.

    They are the imaginary eigenvalues of the Hamiltonian [[A, b b'], [-c'c, -A']] (Boyd,
    Balakrishnan and Kabamba, Math. Control Signals Syst. 2, 1989), so that no peak, however narrow,
    falls between the points of a grid; each is then solved for in |h| itself.
    """
    n, c = len(loop.H), loop.rows.sum(axis=0)
    size = abs(loop.b) * np.linalg.norm(c)
    if size == 0.0:
        return []
    into = np.zeros((n, n))
    into[0, 0] = size
    out = np.outer(c, c) * (size / (c @ c))
    values = np.linalg.eigvals(np.block([[loop.H, into], [-out, -loop.H.T]]))
    is_near = np.abs(values.real) <= _NEAR_AXIS * np.abs(values.imag)
    slowest = 2.0 * np.pi * SLOWEST_HZ
    polished = [_polish(loop, w) for w in values.imag[is_near & (values.imag > slowest / 2.0)]]
    found: list[float] = []
    for w in sorted(w for w in polished if w is not None and w >= slowest):
        if not found or w - found[-1] > 1e-8 * w:
            found.append(w)
    return found


def _polish(loop: Loop, near: float) -> float | None:
    """Return the w beside `near` with |h(j w)| = 1 by Newton's iteration, or None."""
    w = near
    for _ in range(20):
        h, slope = _gain(loop, w)
        if abs(np.log(abs(h))) <= 1e-12:
            return w
        w -= np.log(abs(h)) / slope
        if not abs(w - near) <= 0.01 * near:
            return None
    return w if abs(np.log(abs(_gain(loop, w)[0]))) <= 1e-8 else None


def _gain(loop: Loop, w: float) -> tuple[complex, float]:
    """Return h(j w) and d ln|h| / dw."""
    right = np.zeros((1, len(loop.H)), np.complex128)
    right[0, 0] = loop.b
    c = loop.rows.sum(axis=0)
    nothing = np.zeros(len(c), np.complex128)
    once = loop.solve(1j * w, nothing, right)
    twice = loop.solve(1j * w, nothing, once)
    h, by_s = complex(c @ once[0]), complex(-(c @ twice[0]))
    return h, float((1j * by_s / h).real)
