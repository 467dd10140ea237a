"""The three-stage turbine governor: reheat steam, hydro or gas turbine by its constants."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import clamp, lag, lead_lag, lead_lag_at
from tieline.grid.models.limits import require_within

PARAMETERS = (
    Parameter("K", "pu", "gain 1/R, power per speed", at_least=0),
    Parameter("Tmax", "pu", "upper limit of the demand; the lower one is 0", above=0),
    Parameter("Ts", "s", "servo time constant", above=0),
    Parameter("Tc", "s", "high-pressure turbine or transient-droop lag", above=0),
    Parameter("T3", "s", "high-pressure turbine or transient-droop lead"),
    Parameter("T4", "s", "turbine lead; negative for a hydro turbine's water column"),
    Parameter("T5", "s", "reheater or water-column lag", above=0),
)
STATES = ("servo", "first", "second")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write P_m from speed and reference."""
    omega, Pref, w0 = u[0], u[1], u[2]
    demand = clamp(Pref + p[P.K] * (w0 - omega), np.zeros_like(omega), p[P.Tmax])
    servo, dx[X.servo] = lag(demand, x[X.servo], p[P.Ts])
    first, dx[X.first] = lead_lag(servo, x[X.first], p[P.T3], p[P.Tc])
    y[0], dx[X.second] = lead_lag(first, x[X.second], p[P.T4], p[P.T5])


class ReheatHydro(Model):
    """A proportional governor, a servo and two lead-lags.

        P_ref + (w0 - omega)/R ->[0, Tmax]->[1/(1+sTs)]->[(1+sT3)/(1+sTc)]->[(1+sT4)/(1+sT5)]-> P_m

    The limiter acts on the demand alone. Not modelled: rate limits, deadband, valve limits.
    """

    key = "reheat_hydro"
    role = "governor"
    source = "Kundur 1994, section 9.2 and 9.1; governor of the miniWECC (Trudnowski 2011)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {"K": 20.0, "Tmax": 1.0, "Ts": 0.5, "Tc": 15.0, "T3": 1.0, "T4": -1.0, "T5": 0.5}
    )
    example_source = "slow hydro unit of the miniWECC (Trudnowski 2011)"
    equations = (Equation(equations, ("omega", "Pref", "w0"), ("Pm",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return P_m over speed and over P_ref."""
        shape = lead_lag_at(s, p["T3"], p["Tc"]) * lead_lag_at(s, p["T4"], p["T5"])
        shape /= 1 + s * p["Ts"]
        return {("omega", "Pm"): -p["K"] * shape, ("Pref", "Pm"): shape}

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's P_m, and set P_ref."""
        Pm = signals["Pm"]
        require_within("Pm", Pm, 0.0, p[P.Tmax])
        signals["Pref"][:] = Pm
        return np.array([Pm, Pm, Pm])
