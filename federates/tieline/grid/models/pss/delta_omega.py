"""The standard delta-omega power system stabiliser."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import clamp, lead_lag, lead_lag_at, washout

PARAMETERS = (
    Parameter("K", "pu", "gain", at_least=0),
    Parameter("Tw", "s", "washout time constant", above=0),
    Parameter("T1", "s", "first lead", at_least=0),
    Parameter("T2", "s", "first lag", above=0),
    Parameter("T3", "s", "second lead", at_least=0),
    Parameter("T4", "s", "second lag", above=0),
    Parameter("vsmax", "pu", "upper output limit", above=0),
    Parameter("vsmin", "pu", "lower output limit", below=0),
)
STATES = ("washout", "first", "second")

P = indices(PARAMETERS)
X = indices(STATES)


@compiled
def compensate(nu: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return v_s for the control error `nu` (n,) and write the states' derivatives."""
    high, dx[X.washout] = washout(nu, x[X.washout], p[P.Tw])
    first, dx[X.first] = lead_lag(p[P.K] * high, x[X.first], p[P.T1], p[P.T2])
    second, dx[X.second] = lead_lag(first, x[X.second], p[P.T3], p[P.T4])
    return clamp(second, p[P.vsmin], p[P.vsmax])


def compensation(s: complex, p: Mapping[str, float]) -> complex:
    """Return v_s over the control error at `s`, inside the limits."""
    washed = p["K"] * s * p["Tw"] / (1 + s * p["Tw"])
    return washed * lead_lag_at(s, p["T1"], p["T2"]) * lead_lag_at(s, p["T3"], p["T4"])


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed deviation."""
    y[0] = compensate(u[0] - u[1], x, p, dx)


class DeltaOmega(Model):
    """A washout, a gain, two lead-lags and an output limit on the unit's own speed deviation.

        omega - w0 ->[sTw/(1+sTw)]->[K]->[(1+sT1)/(1+sT2)]->[(1+sT3)/(1+sT4)]->[vsmin, vsmax]-> v_s

    The limit clips the output; the states go on. Not modelled: transducer and torsional filter.
    """

    key = "delta_omega"
    role = "pss"
    source = "Kundur 1994, section 12.5; IEEE Std 421.5-2016, type PSS1A with A1 = A2 = T6 = 0"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "K": 9.0, "Tw": 10.0, "T1": 0.25, "T2": 0.04, "T3": 0.2, "T4": 0.03,
            "vsmax": 0.1, "vsmin": -0.1,
        }
    )  # fmt: skip
    example_source = "miniWECC (Trudnowski 2011) with the gain of the paper's trip of G26"
    equations = (Equation(equations, ("omega", "w0"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over speed."""
        return {("omega", "v_s"): compensation(s, p)}

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: all zero, as the speed is synchronous."""
        return np.zeros((len(STATES), p.shape[1]))
