"""PSS1A, the single-input power system stabiliser of IEEE Std 421.5."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    second_order,
    second_order_at,
    washout,
    washout_at,
)

PARAMETERS = (
    Parameter("KS", "pu", "gain"),
    Parameter("A1", "s", "first coefficient of the signal conditioning", at_least=0, default=0),
    Parameter("A2", "s2", "second coefficient of the signal conditioning", at_least=0, default=0),
    Parameter("T1", "s", "first lead", at_least=0),
    Parameter("T2", "s", "first lag", at_least=0),
    Parameter("T3", "s", "second lead", at_least=0),
    Parameter("T4", "s", "second lag", at_least=0),
    Parameter("T5", "s", "washout", above=0),
    Parameter("T6", "s", "transducer", at_least=0, default=0),
    Parameter("VSTmax", "pu", "upper output limit", above=0),
    Parameter("VSTmin", "pu", "lower output limit", below=0),
)
STATES = ("transducer", "washout", "filter", "filter_rate", "first", "second")
LEAD_LAGS = (("T1", "T2"), ("T3", "T4"))

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed deviation."""
    sensed, dx[X.transducer] = lag_or_pass(u[0] - u[1], x[X.transducer], p[P.T6])
    high, dx[X.washout] = washout(sensed, x[X.washout], p[P.T5])
    none = np.zeros_like(high)
    shaped, dx[X.filter], dx[X.filter_rate] = second_order(
        p[P.KS] * high, x[X.filter], x[X.filter_rate], (none, none), (p[P.A1], p[P.A2])
    )
    first, dx[X.first] = lead_lag_or_pass(shaped, x[X.first], p[P.T1], p[P.T2])
    second, dx[X.second] = lead_lag_or_pass(first, x[X.second], p[P.T3], p[P.T4])
    y[0] = clamp(second, p[P.VSTmin], p[P.VSTmax])


class PSS1A(Model):
    """A transducer, a washout, signal conditioning and two lead-lags on one signal, the speed.

        omega - w0 ->[1/(1+sT6)]->[KS sT5/(1+sT5)]->[1/(1+sA1+s^2 A2)]
            ->[(1+sT1)/(1+sT2)]->[(1+sT3)/(1+sT4)]->[VSTmin, VSTmax]-> v_s

    T6 = 0 bypasses the transducer, A1 = A2 = 0 the conditioning, and both constants of a lead-lag
    0 that lead-lag; the limit clips the output while the states go on. The standard leaves the
    input to the user; here it is the rotor speed. Not modelled: the other inputs (frequency,
    electrical power).
    """

    key = "pss1a"
    role = "pss"
    source = "IEEE Std 421.5-2016, clause 9, type PSS1A (421.5-2005, 8.1)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "KS": 5.0, "A1": 0.061, "A2": 0.0017, "T1": 0.3, "T2": 0.03, "T3": 0.3, "T4": 0.03,
            "T5": 10.0, "T6": 0.01, "VSTmax": 0.05, "VSTmin": -0.05,
        }
    )  # fmt: skip
    example_source = "typical values of IEC 61970-302, class PssIEEE1A"
    equations = (Equation(equations, ("omega", "w0"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over speed."""
        forward = p["KS"] * washout_at(s, p["T5"]) / (1 + s * p["T6"])
        forward *= second_order_at(s, 0.0, 0.0, p["A1"], p["A2"])
        for lead, lag in LEAD_LAGS:
            forward *= lead_lag_at(s, p[lead], p[lag])
        return {("omega", "v_s"): forward}

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return lead-lags without a lag, and a signal conditioning that rings for ever."""
        wrong = leads_without_lags(values, LEAD_LAGS)
        if values["A2"] > 0 == values["A1"]:
            wrong.append(f"needs A1 > 0 s beside A2 = {values['A2']:g} s2; both 0 bypass the block")
        return wrong

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: all zero, as the speed is synchronous."""
        return np.zeros((len(STATES), p.shape[1]))
