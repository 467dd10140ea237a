"""The simple exciter: a transducer, an optional lead-lag and a limited lag."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks, excitation
from tieline.grid.models.base import Array, Equation, Model, indices
from tieline.grid.models.blocks import (
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    limited_lag,
)
from tieline.grid.models.limits import require_within

PARAMETERS = (
    excitation.TR, excitation.TC, excitation.TB, excitation.KA, excitation.TA,
    excitation.VRmax, excitation.VRmin,
)  # fmt: skip
STATES = ("V_C", "V_A", "V_R")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s and V_ref."""
    V_C, dx[X.V_C] = lag_or_pass(u[0], x[X.V_C], p[P.TR])
    V_A, dx[X.V_A] = lead_lag_or_pass(u[2] - V_C + u[1], x[X.V_A], p[P.TC], p[P.TB])
    y[0], dx[X.V_R] = limited_lag(V_A, x[X.V_R], p[P.KA], p[P.TA], p[P.VRmin], p[P.VRmax])


class Simple(Model):
    """A regulator whose output is the field voltage, whatever the terminal voltage.

        V_t ->[1/(1+sTR)]-> V_C
        V_ref - V_C + v_s ->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]-> E_fd
                                               VRmin..VRmax (non-windup)

    TR = 0, TA = 0 and TB = TC = 0 bypass their blocks. Not modelled: limits of the voltage error,
    rectifier, dependence of the limits on the terminal voltage.
    """

    key = "simple"
    role = "exciter"
    source = "Kundur 1994, section 8.6.3 and example 12.6, thyristor exciter with a high gain"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {"TR": 0.02, "TC": 0.0, "TB": 0.0, "KA": 100.0, "TA": 0.05, "VRmax": 5.0, "VRmin": -5.0}
    )
    example_source = "every unit of the two-area system (PSTess, d2asbegp_ess)"
    equations = (Equation(equations, ("vt", "v_s", "Vref"), ("Efd",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the lead-lag or the order of the limits."""
        return leads_without_lags(values, [("TC", "TB")]) + checks.order(values, "VRmin", "VRmax")

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return E_fd over v_s, V_ref and V_t."""
        forward = lead_lag_at(s, p["TC"], p["TB"]) * p["KA"] / (1 + s * p["TA"])
        return excitation.over_error(forward, s, p)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        Efd = signals["Efd"]
        require_within("Efd", Efd, p[P.VRmin], p[P.VRmax])
        error = Efd / p[P.KA]
        signals["Vref"][:] = signals["vt"] + error
        return np.array([signals["vt"], error, Efd])
