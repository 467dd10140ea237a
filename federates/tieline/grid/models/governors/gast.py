"""GAST, the simple gas turbine governor of PES-TR1."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import lag, limited_integrator
from tieline.grid.models.limits import require_within

PARAMETERS = (
    Parameter("R", "pu", "permanent droop, speed per power", above=0),
    Parameter("T1", "s", "fuel valve time constant", above=0),
    Parameter("T2", "s", "turbine time constant", above=0),
    Parameter("T3", "s", "exhaust temperature time constant", above=0),
    Parameter("AT", "pu", "ambient temperature load limit", above=0),
    Parameter("KT", "pu", "gain of the temperature limit", at_least=0),
    Parameter("VMAX", "pu", "upper limit of the fuel valve", above=0),
    Parameter("VMIN", "pu", "lower limit of the fuel valve"),
    Parameter("Dturb", "pu", "turbine damping, power per speed", at_least=0),
)
STATES = ("valve", "turbine", "exhaust")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write P_m from speed and reference."""
    d_omega, Pref = u[0] - u[2], u[1]
    load_limit = p[P.AT] + p[P.KT] * (p[P.AT] - x[X.exhaust])
    demand = np.minimum(Pref - d_omega / p[P.R], load_limit)
    rate = (demand - x[X.valve]) / p[P.T1]
    valve, dx[X.valve] = limited_integrator(rate, x[X.valve], p[P.VMIN], p[P.VMAX])
    turbine, dx[X.turbine] = lag(valve, x[X.turbine], p[P.T2])
    _, dx[X.exhaust] = lag(turbine, x[X.exhaust], p[P.T3])
    y[0] = turbine - p[P.Dturb] * d_omega


class GAST(Model):
    """A droop governor whose fuel demand gives way to a limit of the exhaust temperature.

        P_ref - d_omega/R -----+->[low]->[1/(1+sT1)]-+->[1/(1+sT2)]-+->(+)-> P_m
        AT + KT (AT - exhaust)-+         VMIN..VMAX                 |  -^ Dturb d_omega
                     exhaust <-[1/(1+sT3)]<-------------------------+    d_omega = omega - w0

    Overspeed closes the valve, whose limits are non-windup. P_ref is a power. Not modelled: rate
    limits, deadband and acceleration control, which the source leaves out as well.
    """

    key = "gast"
    role = "governor"
    source = "IEEE PES-TR1, Dynamic Models for Turbine-Governors, 2013, gas turbines (GAST)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "R": 0.04, "T1": 0.5, "T2": 0.5, "T3": 3.0, "AT": 1.0, "KT": 3.0, "VMAX": 1.0,
            "VMIN": 0.0, "Dturb": 0.18,
        }
    )  # fmt: skip
    example_source = "typical values of IEC 61970-302, class GovGAST"
    equations = (Equation(equations, ("omega", "Pref", "w0"), ("Pm",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the order of the limits."""
        return checks.order(values, "VMIN", "VMAX")

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return P_m over speed and over P_ref, below the temperature limit."""
        turbine = 1 / ((1 + s * p["T1"]) * (1 + s * p["T2"]))
        return {("omega", "Pm"): -turbine / p["R"] - p["Dturb"], ("Pref", "Pm"): turbine}

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's P_m, and set P_ref."""
        Pm = signals["Pm"]
        require_within("Pm", Pm, p[P.VMIN], p[P.VMAX])
        require_within("Pm (temperature limit)", Pm, -np.inf, p[P.AT])
        signals["Pref"][:] = Pm
        return np.array([Pm, Pm, Pm])
