"""A delay of one signal as a small linear system, by collocation or by Padé's approximant."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class DelayLine(NamedTuple):
    """A delay of 1 s: dw/dt = F w + g y, delayed y = h w + d y.

    A delay of tau seconds has F / tau and g / tau.

    Attributes:
        F: (order, order).
        g: (order,) what the signal does to the line.
        h: (order,) what leaves the line.
        d: what leaves it at once.
    """

    F: Floats
    g: Floats
    h: Floats
    d: float


def chebyshev_line(order: int) -> DelayLine:
    """Return a delay as transport along a line, collocated at order + 1 Chebyshev points.

    What passed u(theta) ago obeys du/dt = du/dtheta on [-1, 0] with u(0) = y; u(-1) leaves. This is
    the infinitesimal generator that Breda, Maset and Vermiglio (SIAM J. Sci. Comput. 27, 2005)
    collocate, and Milano and Anghel (IEEE Trans. Circuits Syst. I 59, 2012) for power systems,
    applied to the one signal that is delayed in place of all states. The differentiation matrix is
    that of Trefethen (Spectral Methods in MATLAB, 2000, chapter 6).
    """
    angle = np.pi * np.arange(order + 1) / order
    x = np.cos(angle)
    side = (-1.0) ** np.arange(order + 1)
    side[[0, -1]] *= 2.0
    D = np.outer(side, 1.0 / side) / (x[:, None] - x + np.eye(order + 1))
    D -= np.diag(D.sum(axis=1))
    # Points run from theta = 0 (x = 1) to -1, where d/dtheta = 2 d/dx.
    last = np.zeros(order)
    last[-1] = 1.0
    return DelayLine(2.0 * D[1:, 1:], 2.0 * D[1:, 0], last, 0.0)


def pade_line(order: int) -> DelayLine:
    """Return the diagonal Padé approximant of exp(-s), of `order` over `order`.

    With T = tanh(s/2), exp(-s) = (1 - T) / (1 + T); and the approximant is what remains when the
    continued fraction T = 1 / (2/s + 1 / (6/s + 1 / (10/s + ...))) (Abramowitz and Stegun, 4.5.70)
    ends after `order` terms. In 1/s that is e' (I/s - K)^-1 e / 2 with K tridiagonal and skew and e
    the first unit vector, which gives

        F = (K - e e' / 2)^-1,   g = -F e,   h = -e' F,   d = (-1)^order

    F + F' = -g g' = -h' h, so both Gramians are the unit matrix: the realisation is balanced at any
    order, where the coefficients of the approximant's polynomials lose all digits.
    """
    terms = 4.0 * np.arange(1, order + 1) - 2.0
    beside = np.sqrt(1.0 / (terms[:-1] * terms[1:]))
    inverse = np.diag(beside, -1) - np.diag(beside, 1)
    inverse[0, 0] = -0.5
    F = np.linalg.inv(inverse)
    return DelayLine(F, -F[:, 0], -F[0], (-1.0) ** order)


LINES: dict[str, Callable[[int], DelayLine]] = {"chebyshev": chebyshev_line, "pade": pade_line}

_ENOUGH = {"chebyshev": (12, 1.0), "pade": (8, 0.75)}
"""Order, and its growth with |s| tau, that hold exp(-s tau) to 1e-8 on the imaginary axis and to
1e-6 in the left half of the disc; the line's own eigenvalues lie outside of the disc then."""


def enough_order(method: str, phase: float) -> int:
    """Return the order that is enough for every s with |s| tau up to `phase`, rad."""
    least, slope = _ENOUGH[method]
    return least + math.ceil(slope * phase)


def with_lines(
    A: Floats, b: Floats, signals: Floats, delays_s: Floats, lines: Sequence[DelayLine]
) -> Floats:
    """Return (n + orders, ...) the matrix of dx/dt = A x + b sum_k (signals_k x) delayed.

    Args:
        A: (n, n).
        b: (n,).
        signals: (lines, n) what is delayed, as rows over the states.
        delays_s: (lines,) above 0.
        lines: the delay of each signal.
    """
    n = len(A)
    ends = n + np.cumsum([len(line.h) for line in lines], dtype=np.int64)
    matrix = np.zeros((ends[-1], ends[-1])) if len(lines) else A.copy()
    matrix[:n, :n] = A
    for line, signal, delay_s, end in zip(lines, signals, delays_s, ends, strict=True):
        of_line = slice(end - len(line.h), end)
        matrix[:n, :n] += line.d * np.outer(b, signal)
        matrix[:n, of_line] = np.outer(b, line.h)
        matrix[of_line, :n] = np.outer(line.g, signal) / delay_s
        matrix[of_line, of_line] = line.F / delay_s
    return matrix
