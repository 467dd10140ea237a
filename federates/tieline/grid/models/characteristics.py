"""Curves without memory that several models share: saturation, rectifier loading, deadband.

Sources: IEEE Std 421.5-2016, Annex C (saturation) and Annex D (rectifier regulation).
"""

import math

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array

_ROOT_3 = math.sqrt(3.0)


@compiled
def saturation(level: Array, E1: Array | float, S1: Array, E2: Array | float, S2: Array) -> Array:
    """Return S(level) = B (level - A)^2 / level above the knee A, 0 below, for level >= 0.

    The curve passes through (E1, S1) and (E2, S2): sqrt(E S) is a straight line in E. The scaled
    quadratic is taken rather than the exponential because it is exactly 0 below a knee, and
    everywhere for S1 = S2 = 0, which an exponential cannot be.
    """
    root_1, root_2 = np.sqrt(E1 * S1), np.sqrt(E2 * S2)
    root = np.maximum(root_2 + (root_2 - root_1) / (E2 - E1) * (level - E2), 0.0)
    return root * root / np.where(level > 0.0, level, 1.0)


def saturation_slope(level: float, E1: float, S1: float, E2: float, S2: float) -> float:
    """Return d(E S(E)) / dE at `level`, for declared transfer functions."""
    root_1, root_2 = math.sqrt(E1 * S1), math.sqrt(E2 * S2)
    steep = (root_2 - root_1) / (E2 - E1)
    return 2.0 * steep * max(root_2 + steep * (level - E2), 0.0)


@compiled
def rectifier(v: Array, drop: Array) -> Array:
    """Return v F_EX(drop / v): the voltage v >= 0 behind a loaded rectifier, drop = K_C I_fd.

        I_N = drop / v     0          sqrt(3)/4             3/4              1
        F_EX            1  | 1 - I_N/sqrt(3) | sqrt(3/4 - I_N^2) | sqrt(3) (1 - I_N) |  0

    The standard prints 0.577, 0.433 and 1.732 for these numbers; unrounded, the pieces meet.
    Nothing is divided by v, so that it may be 0.
    """
    chord = np.sqrt(np.maximum(0.75 * v * v - drop * drop, 0.0))
    steep = _ROOT_3 * np.maximum(v - drop, 0.0)
    loaded = np.where(
        drop <= 0.25 * _ROOT_3 * v, v - drop / _ROOT_3, np.where(drop <= 0.75 * v, chord, steep)
    )
    return np.where(drop <= 0.0, v, loaded)


def rectifier_source(y: Array, drop: Array) -> Array:
    """Return (n,) the voltage v whose `rectifier(v, drop)` is y > 0."""
    line, chord = y + drop / _ROOT_3, np.sqrt((y * y + drop * drop) / 0.75)
    loaded = np.where(
        drop <= 0.25 * _ROOT_3 * line,
        line,
        np.where(drop <= 0.75 * chord, chord, y / _ROOT_3 + drop),
    )
    return np.where(drop <= 0.0, y, loaded)


def rectifier_slope(v: float, drop: float) -> float:
    """Return d(v F_EX(drop / v)) / dv, for declared transfer functions."""
    if drop <= 0.25 * _ROOT_3 * v:
        return 1.0
    if drop <= 0.75 * v:
        return 0.75 * v / math.sqrt(0.75 * v * v - drop * drop)
    return _ROOT_3 if drop < v else 0.0


@compiled
def deadband(u: Array, width: Array) -> Array:
    """Return what of `u` lies beyond +-width; continuous, without a step at its edges."""
    return u - np.minimum(np.maximum(u, -width), width)
