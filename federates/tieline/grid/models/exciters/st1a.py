"""ST1A, the bus-fed thyristor exciter of IEEE Std 421.5."""

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
    limited_lag,
    rate_feedback,
)
from tieline.grid.models.limits import require_within

PARAMETERS = (
    excitation.TR, excitation.VImax, excitation.VImin, excitation.TC, excitation.TB,
    Parameter("TC1", "s", "second lead time constant", at_least=0),
    Parameter("TB1", "s", "second lag; TB1 = TC1 = 0 bypass it", at_least=0),
    excitation.KA, excitation.TA, excitation.VAmax, excitation.VAmin, excitation.VRmax,
    excitation.VRmin, excitation.KC, excitation.KF, excitation.TF,
    Parameter("KLR", "pu", "gain of the field current limiter; 0 leaves it out", at_least=0),
    Parameter("ILR", "pu", "field current above which the limiter acts", at_least=0),
)  # fmt: skip
STATES = ("V_C", "V_L", "V_L1", "V_A", "V_F")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s, V_ref and I_fd."""
    vt, Ifd = u[0], u[3]
    excess = p[P.KLR] * np.maximum(Ifd - p[P.ILR], 0.0)
    V_C, dx[X.V_C] = lag_or_pass(vt, x[X.V_C], p[P.TR])
    # With K_F > 0 the regulator has a lag, so that its output is known from its state.
    back = clamp(x[X.V_A], p[P.VAmin], p[P.VAmax]) - excess
    V_F, dx[X.V_F] = rate_feedback(back, x[X.V_F], p[P.KF], p[P.TF])
    V_I = clamp(u[2] - V_C + u[1] - V_F, p[P.VImin], p[P.VImax])
    V_L, dx[X.V_L] = lead_lag_or_pass(V_I, x[X.V_L], p[P.TC], p[P.TB])
    V_L, dx[X.V_L1] = lead_lag_or_pass(V_L, x[X.V_L1], p[P.TC1], p[P.TB1])
    V_A, dx[X.V_A] = limited_lag(V_L, x[X.V_A], p[P.KA], p[P.TA], p[P.VAmin], p[P.VAmax])
    y[0] = clamp(V_A - excess, vt * p[P.VRmin], vt * p[P.VRmax] - p[P.KC] * Ifd)


class ST1A(Model):
    """A regulator that fires a bridge whose ceilings are in proportion to the terminal voltage.

        V_t ->[1/(1+sTR)]-> V_C
        V_ref - V_C + v_s - V_F ->[VImin..VImax]->[(1+sTC)/(1+sTB)]->[(1+sTC1)/(1+sTB1)]
            ->[KA/(1+sTA)]->(+)-+->[V_t VRmin .. V_t VRmax - KC I_fd]-> E_fd
              VAmin..VAmax -^   +->[sKF/(1+sTF)]-> V_F
                  KLR max(I_fd - ILR, 0)

    V_A's limits are non-windup, the others clip. TR = 0, TA = 0 and each pair TB = TC = 0,
    TB1 = TC1 = 0 bypass their blocks. The stabiliser acts at the voltage error. Not modelled:
    under- and overexcitation limiters at the gates, the other place of the stabiliser's input, load
    compensation.
    """

    key = "st1a"
    role = "exciter"
    source = "IEEE Std 421.5-2005, section 7.1, figure 7-1; ST1C of 421.5-2016 adds limiter inputs"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "TR": 0.04, "VImax": 99.0, "VImin": -99.0, "TC": 1.0, "TB": 10.0, "TC1": 0.0,
            "TB1": 0.0, "KA": 190.0, "TA": 0.0, "VAmax": 99.0, "VAmin": -99.0, "VRmax": 7.8,
            "VRmin": -6.7, "KC": 0.08, "KF": 0.0, "TF": 1.0, "KLR": 0.0, "ILR": 0.0,
        }
    )  # fmt: skip
    example_source = "sample data of IEEE Std 421.5-2005, Annex H; unused limits set to 99"
    equations = (Equation(equations, ("vt", "v_s", "Vref", "Ifd"), ("Efd",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the lead-lags, the limits or the rate feedback."""
        wrong = leads_without_lags(values, [("TC", "TB"), ("TC1", "TB1")])
        wrong += checks.order(values, "VAmin", "VAmax") + checks.order(values, "VRmin", "VRmax")
        if values["KF"] > 0 and values["TA"] == 0:
            wrong.append(f"needs TA > 0 s beside KF > 0 (got KF = {values['KF']:g})")
        return wrong

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return E_fd over v_s, V_ref and V_t."""
        forward = lead_lag_at(s, p["TC"], p["TB"]) * lead_lag_at(s, p["TC1"], p["TB1"])
        forward *= p["KA"] / (1 + s * p["TA"])
        feedback = s * p["KF"] / (1 + s * p["TF"])
        return excitation.over_error(forward / (1 + forward * feedback), s, p)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        vt, Efd, Ifd = signals["vt"], signals["Efd"], signals["Ifd"]
        require_within("Efd", Efd, vt * p[P.VRmin], vt * p[P.VRmax] - p[P.KC] * Ifd)
        V_A = Efd + p[P.KLR] * np.maximum(Ifd - p[P.ILR], 0.0)
        error = V_A / p[P.KA]
        require_within("V_A", V_A, p[P.VAmin], p[P.VAmax])
        require_within("V_I", error, p[P.VImin], p[P.VImax])
        signals["Vref"][:] = vt + error
        return np.array([vt, error, error, V_A, Efd])
