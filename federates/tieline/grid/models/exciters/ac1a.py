"""AC1A, the alternator exciter with uncontrolled rectifiers of IEEE Std 421.5."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks, excitation
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    limited_integrator,
    limited_lag,
    rate_feedback,
)
from tieline.grid.models.characteristics import (
    rectifier,
    rectifier_slope,
    rectifier_source,
    saturation,
    saturation_slope,
)
from tieline.grid.models.limits import require_within

PARAMETERS = (
    excitation.TR, excitation.TC, excitation.TB, excitation.KA, excitation.TA,
    excitation.VAmax, excitation.VAmin, excitation.VRmax, excitation.VRmin, excitation.TE,
    excitation.KE, Parameter("KD", "pu", "demagnetising by the field current", at_least=0),
    excitation.KC, excitation.KF, excitation.TF, excitation.E1, excitation.SE1, excitation.E2,
    excitation.SE2,
)  # fmt: skip
STATES = ("V_C", "V_L", "V_A", "V_E", "V_F")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s, V_ref and I_fd."""
    Ifd, V_E = u[3], np.maximum(x[X.V_E], 0.0)
    S = saturation(V_E, p[P.E1], p[P.SE1], p[P.E2], p[P.SE2])
    V_FE = (p[P.KE] + S) * V_E + p[P.KD] * Ifd
    V_C, dx[X.V_C] = lag_or_pass(u[0], x[X.V_C], p[P.TR])
    V_F, dx[X.V_F] = rate_feedback(V_FE, x[X.V_F], p[P.KF], p[P.TF])
    V_L, dx[X.V_L] = lead_lag_or_pass(u[2] - V_C + u[1] - V_F, x[X.V_L], p[P.TC], p[P.TB])
    V_A, dx[X.V_A] = limited_lag(V_L, x[X.V_A], p[P.KA], p[P.TA], p[P.VAmin], p[P.VAmax])
    rate = (clamp(V_A, p[P.VRmin], p[P.VRmax]) - V_FE) / p[P.TE]
    low = np.zeros_like(V_E)
    V_E, dx[X.V_E] = limited_integrator(rate, x[X.V_E], low, np.full_like(V_E, np.inf))
    y[0] = rectifier(V_E, p[P.KC] * Ifd)


class AC1A(Model):
    """A regulator that drives the field of an alternator whose rectified voltage is E_fd.

        V_t ->[1/(1+sTR)]-> V_C
        V_ref - V_C + v_s - V_F ->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]->[VRmin..VRmax]-> V_R
                                                     VAmin..VAmax
        V_R ->(+)->[1/(sTE)]-> V_E ->(x)-> E_fd      V_FE = KE V_E + SE(V_E) V_E + KD I_fd
             -^     0..               ^              V_F  = sKF/(1+sTF) V_FE
            V_FE               F_EX(KC I_fd / V_E)

    The limits of V_A and V_E are non-windup, those of V_R clip. TR = 0, TA = 0 and TB = TC = 0
    bypass their blocks. SE is the scaled quadratic through (E1, SE1) and (E2, SE2), E1 < E2.
    Not modelled: under- and overexcitation limiters at the gates, load compensation, effect of
    speed.
    """

    key = "ac1a"
    role = "exciter"
    source = "IEEE Std 421.5-2005, section 6.1, figure 6-1; AC1C of 421.5-2016 adds limiter inputs"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "TR": 0.0, "TC": 0.0, "TB": 0.0, "KA": 400.0, "TA": 0.02, "VAmax": 14.5, "VAmin": -14.5,
            "VRmax": 6.03, "VRmin": -5.43, "TE": 0.8, "KE": 1.0, "KD": 0.38, "KC": 0.2, "KF": 0.03,
            "TF": 1.0, "E1": 3.14, "SE1": 0.03, "E2": 4.18, "SE2": 0.1,
        }
    )  # fmt: skip
    example_source = "sample data of IEEE Std 421.5-2005, Annex H"
    equations = (Equation(equations, ("vt", "v_s", "Vref", "Ifd"), ("Efd",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the lead-lag, the limits or the points of saturation."""
        return [
            *leads_without_lags(values, [("TC", "TB")]),
            *checks.order(values, "VAmin", "VAmax"),
            *checks.order(values, "VRmin", "VRmax"),
            *checks.saturation(values, "E1", "SE1", "E2", "SE2"),
        ]

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return E_fd over v_s, V_ref and V_t."""
        drop = p["KC"] * at["Ifd"]
        V_E = float(rectifier_source(np.array(at["Efd"]), np.array(drop)))
        field = p["KE"] + saturation_slope(V_E, p["E1"], p["SE1"], p["E2"], p["SE2"])
        regulator = lead_lag_at(s, p["TC"], p["TB"]) * p["KA"] / (1 + s * p["TA"])
        forward = regulator / (s * p["TE"] + field)
        feedback = field * s * p["KF"] / (1 + s * p["TF"])
        closed = forward / (1 + forward * feedback)
        return excitation.over_error(rectifier_slope(V_E, drop) * closed, s, p)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        Efd, Ifd = signals["Efd"], signals["Ifd"]
        require_within("Efd", Efd, 0.0, np.inf)
        V_E = rectifier_source(Efd, p[P.KC] * Ifd)
        S = saturation(V_E, p[P.E1], p[P.SE1], p[P.E2], p[P.SE2])
        V_A = (p[P.KE] + S) * V_E + p[P.KD] * Ifd
        require_within("V_A", V_A, p[P.VAmin], p[P.VAmax])
        require_within("V_R", V_A, p[P.VRmin], p[P.VRmax])
        error = V_A / p[P.KA]
        signals["Vref"][:] = signals["vt"] + error
        return np.array([signals["vt"], error, V_A, V_E, V_A])
