"""The pure blocks that models are wired from: (input, state, parameters) -> (output, derivative).

Every argument is an array (n,), one element a unit. Source of the blocks' limiters: IEEE Std
421.5-2016, Annex E.
"""

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array


@compiled
def washout(u: Array, x: Array, T: Array) -> tuple[Array, Array]:
    """Return output and derivative of s T / (1 + s T).

    u --->(+)---> y         dx/dt = y / T
         - ^
           x <--[1/(s T)]-- y
    """
    y = u - x
    return y, y / T


@compiled
def lead_lag(u: Array, x: Array, T1: Array, T2: Array) -> tuple[Array, Array]:
    """Return output and derivative of (1 + s T1) / (1 + s T2); at rest y = x = u."""
    rate = (u - x) / T2
    return x + T1 * rate, rate


def lead_lag_at(s: complex, T1: float, T2: float) -> complex:
    """Return (1 + s T1) / (1 + s T2), for declared transfer functions."""
    return (1 + s * T1) / (1 + s * T2)


@compiled
def lag(u: Array, x: Array, T: Array) -> tuple[Array, Array]:
    """Return output and derivative of 1 / (1 + s T)."""
    return x, (u - x) / T


@compiled
def lag_non_windup(
    u: Array, x: Array, K: Array, T: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Return output and derivative of K / (1 + s T) with non-windup limits (Annex E.3).

    The state stops at a limit and leaves it as soon as its derivative points inwards.
    """
    y = np.minimum(np.maximum(x, low), high)
    rate = (K * u - y) / T
    stuck = ((x >= high) & (rate > 0)) | ((x <= low) & (rate < 0))
    return y, np.where(stuck, 0.0, rate)


@compiled
def clamp(u: Array, low: Array, high: Array) -> Array:
    """Return `u` limited to [low, high]; states behind it go on (a windup limiter)."""
    return np.minimum(np.maximum(u, low), high)
