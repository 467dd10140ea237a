"""The generalised delta-omega power system stabiliser of Elliott, Arabshahi and Kirschen."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.pss import delta_omega

PARAMETERS = (
    *delta_omega.PARAMETERS,
    Parameter("beta1", "1", "share of the speed against the average", at_least=0, at_most=1),
    Parameter(
        "beta2", "1", "share of the average against synchronous speed", at_least=0, at_most=1
    ),
)

P = indices(PARAMETERS)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed and the average that it believes."""
    omega, wbar, w0 = u[0], u[1], u[2]
    nu = p[P.beta2] * (omega - w0) + (p[P.beta1] - p[P.beta2]) * (omega - wbar)
    y[0] = delta_omega.compensate(nu, x, p, dx)


class GeneralizedDeltaOmega(Model):
    """A delta-omega stabiliser that weighs a unit's swing and the system's motion on their own.

        nu = beta1 (omega - wbar) + beta2 (wbar - w0)
           = beta2 (omega - w0) + (beta1 - beta2) (omega - wbar)

    nu then passes the washout, gain, lead-lags and limit of `delta_omega`. The second form is the
    one that is computed: with beta1 = beta2 the average, however late, drops out to the last bit.
    """

    key = "generalized_delta_omega"
    role = "pss"
    source = (
        "Elliott, Arabshahi and Kirschen, A Generalized PSS Architecture for Balancing Transient "
        "and Small-Signal Response"
    )
    parameters = PARAMETERS
    states = delta_omega.STATES
    example = MappingProxyType({**delta_omega.DeltaOmega.example, "beta1": 1.0, "beta2": 0.5})
    example_source = "the paper's trip of G26, tuned to the inter-area modes"
    equations = (Equation(equations, ("omega", "wbar", "w0"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over the unit's speed and over the average."""
        forward = delta_omega.compensation(s, p)
        return {
            ("omega", "v_s"): p["beta1"] * forward,
            ("wbar", "v_s"): (p["beta2"] - p["beta1"]) * forward,
        }

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: all zero, as every speed is synchronous."""
        return np.zeros((len(delta_omega.STATES), p.shape[1]))
