"""The generalised delta-omega power system stabiliser of Elliott, Arabshahi and Kirschen."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    lead_lag,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    washout,
    washout_at,
)
from tieline.grid.models.pss.delta_omega import DeltaOmega

PARAMETERS = (
    Parameter("K", "pu", "gain", at_least=0),
    Parameter("Tw", "s", "washout time constant", above=0),
    Parameter("T1", "s", "first lead", at_least=0),
    Parameter("T2", "s", "first lag", above=0),
    Parameter("T3", "s", "second lead", at_least=0),
    Parameter("T4", "s", "second lag", at_least=0),
    Parameter("T5", "s", "third lead", at_least=0, default=0),
    Parameter("T6", "s", "third lag", at_least=0, default=0),
    Parameter("vsmax", "pu", "upper output limit", above=0),
    Parameter("vsmin", "pu", "lower output limit", below=0),
    Parameter("beta1", "1", "share of the speed against the average", at_least=0, at_most=1),
    Parameter(
        "beta2", "1", "share of the average against synchronous speed", at_least=0, at_most=1
    ),
)
STATES = ("washout", "first", "second", "third")
LEAD_LAGS = (("T1", "T2"), ("T3", "T4"), ("T5", "T6"))
SOURCE = (
    "Elliott, Arabshahi and Kirschen, A Generalized PSS Architecture for Balancing Transient "
    "and Small-Signal Response"
)
EXAMPLE = MappingProxyType({**DeltaOmega.example, "T5": 0.0, "T6": 0.0, "beta1": 1.0, "beta2": 0.5})
EXAMPLE_SOURCE = "the paper's trip of G26, tuned to the inter-area modes"

P = indices(PARAMETERS)
X = indices(STATES)


@compiled
def compensate(nu: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return v_s for the control error `nu` (n,) and write the states' derivatives."""
    high, dx[X.washout] = washout(nu, x[X.washout], p[P.Tw])
    v, dx[X.first] = lead_lag(p[P.K] * high, x[X.first], p[P.T1], p[P.T2])
    v, dx[X.second] = lead_lag_or_pass(v, x[X.second], p[P.T3], p[P.T4])
    v, dx[X.third] = lead_lag_or_pass(v, x[X.third], p[P.T5], p[P.T6])
    return clamp(v, p[P.vsmin], p[P.vsmax])


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed and the average that it believes."""
    omega, wbar, w0 = u[0], u[1], u[2]
    nu = p[P.beta2] * (omega - w0) + (p[P.beta1] - p[P.beta2]) * (omega - wbar)
    y[0] = compensate(nu, x, p, dx)


class GeneralizedDeltaOmega(Model):
    """A delta-omega stabiliser that weighs a unit's swing and the system's motion on their own.

        nu = beta1 (omega - wbar) + beta2 (wbar - w0)
           = beta2 (omega - w0) + (beta1 - beta2) (omega - wbar)

        nu ->[K sTw/(1+sTw)]->[(1+sT1)/(1+sT2)]->[..T3/T4]->[..T5/T6]->[vsmin, vsmax]-> v_s

    The second form of nu is the one that is computed: with beta1 = beta2 the average, however
    late, drops out to the last bit, and the rest is `delta_omega`. One to three lead-lags: the
    second and the third are bypassed where both their constants are 0. The limit clips the output;
    the states go on. Not modelled: transducer and torsional filter (`generalized_pss2c` needs
    none).

    The paper writes the same control in two other forms, `generalized_constant_reference` and
    `generalized_synchronous_reference`.
    """

    key = "generalized_delta_omega"
    role = "pss"
    source = SOURCE
    parameters = PARAMETERS
    states = STATES
    example = EXAMPLE
    example_source = EXAMPLE_SOURCE
    equations = (Equation(equations, ("omega", "wbar", "w0"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over the unit's speed and over the average."""
        forward = p["K"] * washout_at(s, p["Tw"])
        for lead, lag in LEAD_LAGS:
            forward *= lead_lag_at(s, p[lead], p[lag])
        return {
            ("omega", "v_s"): p["beta1"] * forward,
            ("wbar", "v_s"): (p["beta2"] - p["beta1"]) * forward,
        }

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return lead-lags without a lag."""
        return leads_without_lags(values, LEAD_LAGS)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: all zero, as every speed is synchronous."""
        return np.zeros((len(STATES), p.shape[1]))
