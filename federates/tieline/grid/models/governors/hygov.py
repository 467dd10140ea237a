"""HYGOV, the hydro turbine governor of PES-TR1."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import clamp, lag, limited_integrator
from tieline.grid.models.limits import require_within

PARAMETERS = (
    Parameter("R", "pu", "permanent droop, speed per gate", above=0),
    Parameter("r", "pu", "temporary droop", above=0),
    Parameter("Tr", "s", "reset time constant", above=0),
    Parameter("Tf", "s", "filter time constant", above=0),
    Parameter("Tg", "s", "gate servo time constant", above=0),
    Parameter("VELM", "pu_s", "largest speed of the gate", above=0),
    Parameter("GMAX", "pu", "largest gate opening", above=0),
    Parameter("GMIN", "pu", "smallest gate opening", at_least=0),
    Parameter("Tw", "s", "water starting time", above=0),
    Parameter("At", "pu", "turbine gain", above=0),
    Parameter("Dturb", "pu", "turbine damping, power per speed and gate", at_least=0),
    Parameter("qNL", "pu", "no-load flow", at_least=0),
)
STATES = ("filter", "demand", "gate", "flow")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write P_m from speed and reference."""
    d_omega, gate, flow = u[0] - u[2], x[X.gate], x[X.flow]
    error = p[P.R] * (u[1] / p[P.At] + p[P.qNL] - x[X.demand]) - d_omega
    held, dx[X.filter] = lag(error, x[X.filter], p[P.Tf])
    rate = clamp((held / p[P.Tr] + dx[X.filter]) / p[P.r], -p[P.VELM], p[P.VELM])
    demand, dx[X.demand] = limited_integrator(rate, x[X.demand], p[P.GMIN], p[P.GMAX])
    gate, dx[X.gate] = lag(demand, gate, p[P.Tg])
    head = (flow / gate) * (flow / gate)
    dx[X.flow] = (1.0 - head) / p[P.Tw]
    y[0] = p[P.At] * head * (flow - p[P.qNL]) - p[P.Dturb] * d_omega * gate


class HYGOV(Model):
    """A governor with permanent and temporary droop and a nonlinear water column.

        n_ref - d_omega - R c ->[1/(1+sTf)]->[(1+sTr)/(r sTr)]-> c ->[1/(1+sTg)]-> gate
                                  +-VELM, GMIN..GMAX (non-windup)
        head = (flow / gate)^2,     Tw dflow/dt = 1 - head,     d_omega = omega - w0
        P_m = At head (flow - qNL) - Dturb d_omega gate

    Overspeed closes the gate. P_ref is a power: n_ref = R (P_ref / At + qNL), so that a step of
    P_ref by 0.1 moves P_m by 0.1. The water column is as quick as 2 / (gate Tw): a gate that all
    but closes is stiff. Not modelled: deadband and the curve of the gate, which the source leaves
    out as well.
    """

    key = "hygov"
    role = "governor"
    source = (
        "IEEE PES-TR1, Dynamic Models for Turbine-Governors, 2013, hydro turbines (HYGOV); IEEE "
        "Working Group, Trans. PWRS-7, 1992, p. 167"
    )
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "R": 0.04, "r": 0.3, "Tr": 5.0, "Tf": 0.05, "Tg": 0.5, "VELM": 0.2, "GMAX": 1.0,
            "GMIN": 0.0, "Tw": 1.0, "At": 1.2, "Dturb": 0.5, "qNL": 0.08,
        }
    )  # fmt: skip
    example_source = "typical values of IEC 61970-302, class GovHydro1"
    equations = (Equation(equations, ("omega", "Pref", "w0"), ("Pm",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the limits or the droops."""
        return checks.order(values, "GMIN", "GMAX") + checks.order(values, "R", "r")

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return P_m over speed and over P_ref, linear around the flow of the power at rest."""
        flow = at["Pm"] / p["At"] + p["qNL"]
        forward = (1 + s * p["Tr"]) / (p["r"] * s * p["Tr"] * (1 + s * p["Tf"]))
        demand = forward / (1 + p["R"] * forward)
        water = p["At"] * (1 - s * p["Tw"] * (flow - p["qNL"])) / (1 + s * p["Tw"] * flow / 2)
        through = demand / (1 + s * p["Tg"]) * water
        return {
            ("omega", "Pm"): -through - p["Dturb"] * flow,
            ("Pref", "Pm"): through * p["R"] / p["At"],
        }

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's P_m, and set P_ref."""
        gate = signals["Pm"] / p[P.At] + p[P.qNL]
        require_within("gate", gate, p[P.GMIN], p[P.GMAX])
        signals["Pref"][:] = signals["Pm"]
        return np.array([np.zeros_like(gate), gate, gate, gate])
