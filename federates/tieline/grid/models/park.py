"""Rotor and network coordinates, and what every machine does alike behind its impedance."""

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array


@compiled
def to_rotor(delta: Array, re: Array, im: Array) -> tuple[Array, Array]:
    """Return the d and q components of a phasor; the q axis leads the reference by delta."""
    sin, cos = np.sin(delta), np.cos(delta)
    return sin * re - cos * im, cos * re + sin * im


@compiled
def current_behind(
    e_re: Array, e_im: Array, v_re: Array, v_im: Array, ra: Array, x: Array
) -> tuple[Array, Array]:
    """Return (E - V) / (ra + j x) in its real and imaginary part."""
    d_re, d_im = e_re - v_re, e_im - v_im
    square = ra * ra + x * x
    return (ra * d_re + x * d_im) / square, (ra * d_im - x * d_re) / square


@compiled
def swing(omega: Array, Pm: Array, torque: Array, D: Array, H: Array) -> Array:
    """Return domega/dt from 2 H domega/dt = P_m / omega - T_e - D (omega - 1)."""
    return (Pm / omega - torque - D * (omega - 1.0)) / (2.0 * H)
