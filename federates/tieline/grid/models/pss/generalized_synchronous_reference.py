"""The generalised delta-omega stabiliser in the form with synchronous speed as reference."""

import numpy as np

from tieline.grid.models.base import Array, Equation
from tieline.grid.models.blocks import where_positive
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega, P, compensate


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed and the average that it believes."""
    omega, wbar, w0 = u[0], u[1], u[2]
    scale = where_positive(p[P.beta2], p[P.beta2], np.ones_like(omega))
    base = where_positive(p[P.beta2], wbar, w0)
    feedback = p[P.beta1] / scale * (omega - wbar) + base
    y[0] = compensate(scale * (feedback - w0), x, p, dx)


class GeneralizedSynchronousReference(GeneralizedDeltaOmega):
    """The generalised stabiliser as a standard one that is fed another speed.

        beta2 > 0:   feedback = (beta1 / beta2) (omega - wbar) + wbar       gain beta2 K
        beta2 = 0:   feedback = beta1 (omega - wbar) + w0                   gain K
        nu = feedback - w0, in units of that gain

    From nu on it is `generalized_delta_omega`, whose output it equals to rounding. An existing
    delta-omega stabiliser becomes generalised in this form: only its input and its gain change.
    Not modelled: what is not modelled there.
    """

    key = "generalized_synchronous_reference"
    equations = (Equation(equations, ("omega", "wbar", "w0"), ("v_s",)),)
