"""Eigenvalues of the closed loop when every sensor of the average is late, and its delay margin.

    dx/dt = A x(t) + b sum_k alpha_k c_k x(t - tau_k)

with A, b, alpha_k and c_k of `linearise.LinearSystem`. Only the average is delayed: a unit's own
speed is local and stays in A. Every distinct delay is therefore a delay of one scalar signal, and
becomes a line of few states (`_delay_lines`) whose eigenvalues are approximate. Exact ones come
from Newton's iteration on the characteristic equation (`_delay_roots`), which also follows a mode
through growing delays (`_delay_paths`), and, on the imaginary axis, from the gain of the average's
path (`_delay_margin`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError, NumericalError
from tieline.grid.tables import near
from tieline.linear._delay_lines import LINES, enough_order, with_lines
from tieline.linear._delay_margin import Crossing, DelayMargin, delay_crossings, delay_margin
from tieline.linear._delay_paths import (
    DampingAgainstDelay,
    damping_against_delay,
    mode_with_delay,
)
from tieline.linear._delay_roots import (
    CONFIRMED,
    HIGHEST_HZ,
    LOWEST_HZ,
    DelayedLoop,
    delays_of,
    loop_of,
    refine,
    weighted_rows,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Method = Literal["chebyshev", "pade"]

__all__ = [
    "HIGHEST_HZ",
    "LOWEST_HZ",
    "Crossing",
    "DampingAgainstDelay",
    "DelayMargin",
    "DelayedLoop",
    "DelayedMode",
    "damping_against_delay",
    "delay_crossings",
    "delay_margin",
    "delayed_eigenvalues",
    "delayed_matrix",
    "mode_with_delay",
    "refined_mode",
]


@dataclass(frozen=True)
class DelayedMode:
    """One eigenvalue of a loop with delays, exact to rounding.

    Attributes:
        eigenvalue: 1/s.
        vector: (n,) its right vector over the states, of length 1.
        residual: relative change of the equations for which the eigenvalue would be exact.
    """

    eigenvalue: complex
    vector: Complexes
    residual: float


def delayed_matrix(
    linear: DelayedLoop,
    delays_s: float | Sequence[float] | Floats,
    method: Method = "chebyshev",
    order: int | None = None,
) -> Floats:
    """Return (n + lines * order, ...) the state matrix of the loop, with a line for each delay.

    The first n states are the system's. Sensors of equal delay share a line, and those without
    delay have none: at zero delay the matrix is the undelayed one.

    Args:
        linear: the system.
        delays_s: one delay, or (members,) one for each member of the average; 0, or 1 us to 10 s.
        method: `chebyshev` collocates, `pade` approximates exp(-s tau) by a ratio of polynomials.
        order: states of each line; by default enough for 1e-8 up to `HIGHEST_HZ`, which is more for
            longer delays.

    Raises:
        InputError: a delay is outside of its bounds, their number is wrong, there is no such
            method, or the order is below 1.
    """
    delays = delays_of(linear, delays_s)
    if method not in LINES:
        known = list(LINES)
        raise InputError(f"no method '{method}' (allowed: {known}){near(method, known)}")
    if order is not None and order < 1:
        raise InputError(f"order must be >= 1 (got {order})")
    b, rows = linear.by_average, weighted_rows(linear)
    distinct, group = np.unique(delays, return_inverse=True)
    signals = np.zeros((len(distinct), rows.shape[1]))
    np.add.at(signals, group, rows)
    is_late = distinct > 0.0
    A = linear.A_without_average + np.outer(b, signals[~is_late].sum(axis=0))
    late = distinct[is_late]
    fastest = 2.0 * np.pi * HIGHEST_HZ
    lines = [LINES[method](order or enough_order(method, fastest * tau)) for tau in late]
    return with_lines(A, b, signals[is_late], late, lines)


def delayed_eigenvalues(
    linear: DelayedLoop,
    delays_s: float | Sequence[float] | Floats,
    method: Method = "chebyshev",
    order: int | None = None,
    refined: bool = False,
) -> Complexes:
    """Return eigenvalues of the loop with delays, 1/s, those with the largest real part first.

    A loop with delays has infinitely many. Unrefined, the result is all (n + lines * order,) of
    `delayed_matrix`, of which those far out belong to the lines alone. Refined, each is corrected
    to an exact eigenvalue, and those without one beside them (within `CONFIRMED`) are left out;
    with the default order that concerns none inside |s| <= 2 pi `HIGHEST_HZ`.

    Args:
        linear: the system.
        delays_s: one delay, or (members,) one for each member of the average.
        method: as for `delayed_matrix`.
        order: as for `delayed_matrix`.
        refined: whether to correct them.

    Raises:
        InputError: as `delayed_matrix`.
        NumericalError: the order is too low for an eigenvalue inside of that circle.
    """
    values = np.linalg.eigvals(delayed_matrix(linear, delays_s, method, order))
    values = values.astype(np.complex128)
    if refined:
        values = _confirmed(linear, delays_of(linear, delays_s), values, order)
    return values[np.lexsort((-values.imag, -values.real))]


def refined_mode(
    linear: DelayedLoop, start: complex, delays_s: float | Sequence[float] | Floats
) -> DelayedMode:
    """Return the exact mode that Newton's iteration reaches from an approximate eigenvalue.

    Args:
        linear: the system.
        start: the approximate eigenvalue, 1/s.
        delays_s: one delay, or (members,) one for each member of the average.

    Raises:
        InputError: a delay is outside of its bounds, or their number is wrong.
        NumericalError: the iteration does not converge.
    """
    delays = delays_of(linear, delays_s)
    loop = loop_of(linear)
    root = refine(loop, delays, start)
    if root is None:
        raise NumericalError(f"no eigenvalue of the loop with delays is reached from {start} 1/s")
    vector = loop.T @ root.vector
    return DelayedMode(root.value, vector / np.linalg.norm(vector), root.residual)


def _confirmed(
    linear: DelayedLoop, delays: Floats, values: Complexes, order: int | None
) -> Complexes:
    loop = loop_of(linear)
    fastest = 2.0 * np.pi * HIGHEST_HZ
    found: list[complex] = []
    for start in values[values.imag >= 0.0]:
        root = refine(loop, delays, complex(start))
        if root is not None and abs(root.value - start) <= CONFIRMED * max(abs(start), 1.0):
            found += [root.value, root.value.conjugate()] if start.imag > 0.0 else [root.value]
        elif abs(start) <= fastest:
            raise NumericalError(
                f"no exact eigenvalue stands beside the approximate one at {complex(start):.4g} "
                f"1/s: the order is too low for a delay of {delays.max()} s (got {order})"
            )
    return np.array(found, np.complex128)
