"""The potential-source static exciter of the miniWECC: the ST3A family without its inner loop."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import clamp, lag_non_windup, lead_lag, lead_lag_at
from tieline.grid.models.limits import require_within

PARAMETERS = (
    Parameter("KA", "pu", "regulator gain", above=0),
    Parameter("TA", "s", "regulator time constant", above=0),
    Parameter("TB", "s", "lag time constant of the transient gain reduction", above=0),
    Parameter("TC", "s", "lead time constant of the transient gain reduction", at_least=0),
    Parameter("VImax", "pu", "upper limit of the voltage error", above=0),
    Parameter("VImin", "pu", "lower limit of the voltage error", below=0),
    Parameter("VRmax", "pu", "upper limit of the regulator", above=0),
    Parameter("VRmin", "pu", "lower limit of the regulator"),
    Parameter("KP", "pu", "gain of the potential source", above=0),
    Parameter("Efdmax", "pu", "upper limit of the field voltage", above=0),
)
STATES = ("V_A", "V_R")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s and V_ref."""
    vt, v_s, Vref = u[0], u[1], u[2]
    V_I = clamp(Vref - vt + v_s, p[P.VImin], p[P.VImax])
    V_A, dx[X.V_A] = lead_lag(V_I, x[X.V_A], p[P.TC], p[P.TB])
    V_R, dx[X.V_R] = lag_non_windup(V_A, x[X.V_R], p[P.KA], p[P.TA], p[P.VRmin], p[P.VRmax])
    y[0] = np.minimum(V_R * p[P.KP] * vt, p[P.Efdmax])


class ST3Potential(Model):
    """A regulator that drives a bridge fed by the terminal voltage.

        V_ref ->(+)->[VImin..VImax]->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]->(x)->[..Efdmax]-> E_fd
               - ^ +                                      VRmin..VRmax  ^
             V_t   v_s                                              KP |V_t|

    Not modelled, because the case's constants are zero: transducer lag, inner field-voltage loop
    (K_M, K_G), current source (K_I), source reactance (X_L) and rectifier loading (K_C).
    """

    key = "st3_potential"
    role = "exciter"
    source = (
        "IEEE Std 421.5-2016, type ST3C and its predecessor ST3A, "
        "with K_I = K_C = K_G = X_L = T_R = 0"
    )
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "KA": 200.0, "TA": 0.02, "TB": 10.0, "TC": 1.0, "VImax": 0.1, "VImin": -0.1,
            "VRmax": 5.0, "VRmin": -5.0, "KP": 1.0, "Efdmax": 5.0,
        }
    )  # fmt: skip
    example_source = "every unit of the miniWECC (Trudnowski 2011)"
    equations = (Equation(equations, ("vt", "v_s", "Vref"), ("Efd",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return E_fd over v_s and over V_ref."""
        forward = lead_lag_at(s, p["TC"], p["TB"]) * p["KA"] / (1 + s * p["TA"])
        forward *= p["KP"] * at["vt"]
        return {("v_s", "Efd"): forward, ("Vref", "Efd"): forward}

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        V_R = signals["Efd"] / (p[P.KP] * signals["vt"])
        V_I = V_R / p[P.KA]
        require_within("Efd", signals["Efd"], -np.inf, p[P.Efdmax])
        require_within("V_R", V_R, p[P.VRmin], p[P.VRmax])
        require_within("V_I", V_I, p[P.VImin], p[P.VImax])
        signals["Vref"][:] = V_I + signals["vt"]
        return np.array([V_I, V_R])
