"""The generalised delta-omega stabiliser in the form with a constant reference."""

from tieline.grid.models.base import Array, Equation
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega, P, compensate


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed and the average that it believes."""
    omega, wbar, w0 = u[0], u[1], u[2]
    reference = p[P.beta2] * w0
    feedback = p[P.beta1] * (omega - wbar) + p[P.beta2] * wbar
    y[0] = compensate(feedback - reference, x, p, dx)


class GeneralizedConstantReference(GeneralizedDeltaOmega):
    """The generalised stabiliser as the tracking of a set-point that never moves.

        reference = beta2 w0          feedback = beta1 (omega - wbar) + beta2 wbar
        nu = feedback - reference

    From nu on it is `generalized_delta_omega`, whose output it equals to rounding. A control
    platform that compares one measured signal with a stored set-point takes it in this form.
    Not modelled: what is not modelled there.
    """

    key = "generalized_constant_reference"
    equations = (Equation(equations, ("omega", "wbar", "w0"), ("v_s",)),)
