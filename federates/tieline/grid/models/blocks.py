"""The pure blocks that models are wired from: (input, state, parameters) -> (output, derivative).

Every argument is an array (n,), one element a unit. Source of the blocks' limiters: IEEE Std
421.5-2016, Annex E.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

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
def zero_where(condition: NDArray[np.bool_], rate: Array) -> Array:
    """Return `rate`, and 0 where the condition holds: a state that stays at its limit."""
    # Loops, here and below, because np.where costs the compiler seconds for each model.
    free = rate.copy()
    for i in range(len(free)):
        if condition[i]:
            free[i] = 0.0
    return free


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
    return y, zero_where(stuck, rate)


@compiled
def clamp(u: Array, low: Array, high: Array) -> Array:
    """Return `u` limited to [low, high]; states behind it go on (a windup limiter)."""
    return np.minimum(np.maximum(u, low), high)


@compiled
def rate_or_zero(gap: Array, T: Array) -> Array:
    """Return gap / T, and 0 where T is 0: the state of a block that is bypassed stays put."""
    rate = np.zeros_like(gap)
    for i in range(len(gap)):
        if T[i] > 0.0:
            rate[i] = gap[i] / T[i]
    return rate


@compiled
def where_positive(T: Array, block: Array, wire: Array) -> Array:
    """Return `block` where T > 0 and `wire` elsewhere."""
    y = wire.copy()
    for i in range(len(y)):
        if T[i] > 0.0:
            y[i] = block[i]
    return y


@compiled
def washout_or_pass(u: Array, x: Array, T: Array) -> tuple[Array, Array]:
    """Return output and derivative of s T / (1 + s T); T = 0 bypasses it, y = u."""
    high = u - x
    return where_positive(T, high, u), rate_or_zero(high, T)


@compiled
def lag_or_pass(u: Array, x: Array, T: Array) -> tuple[Array, Array]:
    """Return output and derivative of 1 / (1 + s T); T = 0 bypasses it, y = u."""
    return where_positive(T, x, u), rate_or_zero(u - x, T)


@compiled
def lead_lag_or_pass(u: Array, x: Array, T1: Array, T2: Array) -> tuple[Array, Array]:
    """Return output and derivative of (1 + s T1) / (1 + s T2); T1 = T2 = 0 bypasses it, y = u."""
    rate = rate_or_zero(u - x, T2)
    return where_positive(T2, x + T1 * rate, u), rate


@compiled
def gain_lead_lag(u: Array, x: Array, K: Array, T1: Array, T2: Array) -> tuple[Array, Array]:
    """Return output and derivative of (K + s T1) / (1 + s T2); T1 = T2 = 0 leaves the gain K."""
    rate = rate_or_zero(u - x, T2)
    return K * where_positive(T2, x, u) + T1 * rate, rate


@compiled
def second_order(
    u: Array, x1: Array, x2: Array, b: tuple[Array, Array], a: tuple[Array, Array]
) -> tuple[Array, Array, Array]:
    """Return output and both derivatives of (1 + b1 s + b2 s^2) / (1 + a1 s + a2 s^2).

        a2 dx2/dt = u - x1 - a1 x2,   dx1/dt = x2,   y = x1 + b1 dx1/dt + b2 dx2/dt

    With a2 = b2 = 0 it is (1 + b1 s) / (1 + a1 s), and with a1 = b1 = 0 as well it is bypassed;
    a2 > 0 without a1 > 0, which would ring for ever, is not meant.
    """
    rate2 = rate_or_zero(u - x1 - a[0] * x2, a[1])
    rate1 = where_positive(a[1], x2, rate_or_zero(u - x1, a[0]))
    y = where_positive(a[0], x1 + b[0] * rate1 + b[1] * rate2, u)
    return y, rate1, rate2


def second_order_at(s: complex, b1: float, b2: float, a1: float, a2: float) -> complex:
    """Return (1 + b1 s + b2 s^2) / (1 + a1 s + a2 s^2), for declared transfer functions."""
    return (1 + b1 * s + b2 * s * s) / (1 + a1 * s + a2 * s * s)


def washout_at(s: complex, T: float) -> complex:
    """Return s T / (1 + s T), and 1 for T = 0, for declared transfer functions."""
    return s * T / (1 + s * T) if T > 0 else 1.0


def leads_without_lags(values: Mapping[str, float], pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return a sentence for each (lead, lag) pair of time constants whose lag alone is 0."""
    return [
        f"needs {lag} > 0 s beside {lead} = {values[lead]:g} s; both 0 bypass the block"
        for lead, lag in pairs
        if values[lag] == 0 != values[lead]
    ]


@compiled
def limited_lag(
    u: Array, x: Array, K: Array, T: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Return output and derivative of K / (1 + s T) with non-windup limits that may move.

    A state that a moving limit has left behind follows it with T instead of waiting beyond it.
    Where T = 0 the output is K u within the limits.
    """
    y = np.minimum(np.maximum(where_positive(T, x, K * u), low), high)
    stuck = ((x >= high) & (K * u > y)) | ((x <= low) & (K * u < y))
    return y, rate_or_zero(np.where(stuck, y, K * u) - x, T)


@compiled
def limited_integrator(rate: Array, x: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return output and derivative of an integrator with non-windup limits (Annex E.2)."""
    y = np.minimum(np.maximum(x, low), high)
    stuck = ((x >= high) & (rate > 0.0)) | ((x <= low) & (rate < 0.0))
    return y, zero_where(stuck, rate)


@compiled
def rate_feedback(u: Array, x: Array, K: Array, T: Array) -> tuple[Array, Array]:
    """Return output and derivative of s K / (1 + s T); T = 0 leaves it out, y = 0."""
    rate = rate_or_zero(u - x, T)
    return K * rate, rate
