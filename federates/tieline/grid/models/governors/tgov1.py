"""TGOV1, the simple steam turbine governor of PES-TR1."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import lead_lag, lead_lag_at, limited_integrator
from tieline.grid.models.limits import require_within

PARAMETERS = (
    Parameter("R", "pu", "permanent droop, speed per power", above=0),
    Parameter("T1", "s", "steam bowl time constant", above=0),
    Parameter("VMAX", "pu", "upper limit of the valve", above=0),
    Parameter("VMIN", "pu", "lower limit of the valve"),
    Parameter("T2", "s", "lead of the turbine; T2/T3 is the high-pressure share", at_least=0),
    Parameter("T3", "s", "reheater time constant", above=0),
    Parameter("Dt", "pu", "turbine damping, power per speed", at_least=0),
)
STATES = ("valve", "reheater")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write P_m from speed and reference."""
    d_omega, Pref = u[0] - u[2], u[1]
    rate = (Pref - d_omega / p[P.R] - x[X.valve]) / p[P.T1]
    valve, dx[X.valve] = limited_integrator(rate, x[X.valve], p[P.VMIN], p[P.VMAX])
    steam, dx[X.reheater] = lead_lag(valve, x[X.reheater], p[P.T2], p[P.T3])
    y[0] = steam - p[P.Dt] * d_omega


class TGOV1(Model):
    """A droop governor, a valve with non-windup limits and a reheater.

        P_ref - d_omega/R ->[1/(1+sT1)]->[(1+sT2)/(1+sT3)]->(+)-> P_m      d_omega = omega - w0
                            VMIN..VMAX                      -^ Dt d_omega

    Overspeed closes the valve. P_ref is a power: the reference of the source, divided by R.
    Not modelled: deadband and rate limits, which the source leaves out as well.
    """

    key = "tgov1"
    role = "governor"
    source = "IEEE PES-TR1, Dynamic Models for Turbine-Governors, 2013, section 2.2 (TGOV1)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {"R": 0.05, "T1": 0.5, "VMAX": 1.0, "VMIN": 0.0, "T2": 3.0, "T3": 10.0, "Dt": 0.0}
    )
    example_source = "typical values of IEC 61970-302, class GovSteam0"
    equations = (Equation(equations, ("omega", "Pref", "w0"), ("Pm",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the order of the limits."""
        return checks.order(values, "VMIN", "VMAX")

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return P_m over speed and over P_ref."""
        turbine = lead_lag_at(s, p["T2"], p["T3"]) / (1 + s * p["T1"])
        return {("omega", "Pm"): -turbine / p["R"] - p["Dt"], ("Pref", "Pm"): turbine}

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's P_m, and set P_ref."""
        Pm = signals["Pm"]
        require_within("Pm", Pm, p[P.VMIN], p[P.VMAX])
        signals["Pref"][:] = Pm
        return np.array([Pm, Pm])
