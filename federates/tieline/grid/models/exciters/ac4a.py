"""AC4A, the alternator-supplied controlled-rectifier exciter of IEEE Std 421.5."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks, excitation
from tieline.grid.models.base import Array, Equation, Model, indices
from tieline.grid.models.blocks import (
    clamp,
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    limited_lag,
)
from tieline.grid.models.limits import require_within

PARAMETERS = (
    excitation.TR, excitation.VImax, excitation.VImin, excitation.TC, excitation.TB, excitation.KA,
    excitation.TA, excitation.VRmax, excitation.VRmin, excitation.KC,
)  # fmt: skip
STATES = ("V_C", "V_A", "E_fd")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s, V_ref and I_fd."""
    V_C, dx[X.V_C] = lag_or_pass(u[0], x[X.V_C], p[P.TR])
    V_I = clamp(u[2] - V_C + u[1], p[P.VImin], p[P.VImax])
    V_A, dx[X.V_A] = lead_lag_or_pass(V_I, x[X.V_A], p[P.TC], p[P.TB])
    high = p[P.VRmax] - p[P.KC] * u[3]
    y[0], dx[X.E_fd] = limited_lag(V_A, x[X.E_fd], p[P.KA], p[P.TA], p[P.VRmin], high)


class AC4A(Model):
    """A regulator that fires a full thyristor bridge behind an alternator of constant voltage.

        V_t ->[1/(1+sTR)]-> V_C
        V_ref - V_C + v_s ->[VImin..VImax]->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]-> E_fd
                                                      VRmin..VRmax - KC I_fd (non-windup)

    TR = 0, TA = 0 and TB = TC = 0 bypass their blocks. Not modelled: underexcitation limiter at the
    high-value gate, load compensation, the alternator's own regulator.
    """

    key = "ac4a"
    role = "exciter"
    source = "IEEE Std 421.5-2005, section 6.4, figure 6-4; AC4C of 421.5-2016 adds limiter inputs"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "TR": 0.0, "VImax": 10.0, "VImin": -10.0, "TC": 1.0, "TB": 10.0, "KA": 200.0,
            "TA": 0.015, "VRmax": 5.64, "VRmin": -4.53, "KC": 0.0,
        }
    )  # fmt: skip
    example_source = "sample data of IEEE Std 421.5-2005, Annex H"
    equations = (Equation(equations, ("vt", "v_s", "Vref", "Ifd"), ("Efd",)),)

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
        error = Efd / p[P.KA]
        require_within("Efd", Efd, p[P.VRmin], p[P.VRmax] - p[P.KC] * signals["Ifd"])
        require_within("V_I", error, p[P.VImin], p[P.VImax])
        signals["Vref"][:] = signals["vt"] + error
        return np.array([signals["vt"], error, Efd])
