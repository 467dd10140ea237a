"""ST3A, the compound-source static exciter with an inner field-voltage loop of IEEE Std 421.5."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models import checks, excitation
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    limited_lag,
)
from tieline.grid.models.characteristics import rectifier
from tieline.grid.models.limits import require_within

PARAMETERS = (
    excitation.TR, excitation.VImax, excitation.VImin, excitation.TC, excitation.TB, excitation.KA,
    excitation.TA, excitation.VRmax, excitation.VRmin,
    Parameter("KM", "pu", "forward gain of the inner loop", above=0),
    Parameter("TM", "s", "forward time constant of the inner loop; 0 bypasses it", at_least=0),
    Parameter("VMmax", "pu", "upper limit of the inner loop", above=0),
    Parameter("VMmin", "pu", "lower limit of the inner loop"),
    Parameter("KG", "pu", "feedback gain of the inner loop", at_least=0),
    Parameter("VGmax", "pu", "upper limit of the inner loop's feedback", above=0),
    Parameter("KP", "pu", "gain of the potential source", at_least=0),
    Parameter("theta_P", "deg", "phase angle of the potential source"),
    Parameter("KI", "pu", "gain of the current source", at_least=0),
    Parameter("XL", "pu", "reactance of the potential source", at_least=0),
    excitation.KC,
    Parameter("VBmax", "pu", "upper limit of the supply voltage", above=0),
)  # fmt: skip
STATES = ("V_C", "V_L", "V_R", "V_M")

P = indices(PARAMETERS)
X = indices(STATES)


@compiled
def supply(v_re: Array, v_im: Array, i_re: Array, i_im: Array, Ifd: Array, p: Array) -> Array:
    """Return V_B, limited, from the terminals' phasors and the field current.

    V_E = |K_P exp(j theta_P) V_t + j (K_I + K_P exp(j theta_P) X_L) I_t|
    """
    angle = np.deg2rad(p[P.theta_P])
    k_re, k_im = p[P.KP] * np.cos(angle), p[P.KP] * np.sin(angle)
    z_re, z_im = -k_im * p[P.XL], p[P.KI] + k_re * p[P.XL]
    e_re = k_re * v_re - k_im * v_im + z_re * i_re - z_im * i_im
    e_im = k_re * v_im + k_im * v_re + z_re * i_im + z_im * i_re
    V_E = np.sqrt(e_re * e_re + e_im * e_im)
    return np.minimum(rectifier(V_E, p[P.KC] * Ifd), p[P.VBmax])


def supply_at(signals: Mapping[str, Array], p: Array) -> Array:
    """Return V_B, limited, from the signals by name."""
    v_re, v_im, i_re, i_im, Ifd = (
        signals[name] for name in ("v_re", "v_im", "i_re", "i_im", "Ifd")
    )
    return supply(v_re, v_im, i_re, i_im, Ifd, p)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s, V_ref, the terminals' phasors and I_fd."""
    V_C, dx[X.V_C] = lag_or_pass(u[0], x[X.V_C], p[P.TR])
    V_I = clamp(u[2] - V_C + u[1], p[P.VImin], p[P.VImax])
    V_L, dx[X.V_L] = lead_lag_or_pass(V_I, x[X.V_L], p[P.TC], p[P.TB])
    V_R, dx[X.V_R] = limited_lag(V_L, x[X.V_R], p[P.KA], p[P.TA], p[P.VRmin], p[P.VRmax])
    V_B = supply(u[3], u[4], u[5], u[6], u[7], p)
    gain = p[P.KG] * V_B
    # With T_M = 0 the loop is algebraic: fed back in proportion, or by the constant V_G max.
    at_once = np.maximum(V_R / (1.0 + p[P.KM] * gain), V_R - p[P.VGmax])
    lagged = V_R - np.minimum(gain * clamp(x[X.V_M], p[P.VMmin], p[P.VMmax]), p[P.VGmax])
    inner = np.where(p[P.TM] > 0.0, lagged, at_once)
    V_M, dx[X.V_M] = limited_lag(inner, x[X.V_M], p[P.KM], p[P.TM], p[P.VMmin], p[P.VMmax])
    y[0] = V_M * V_B


class ST3A(Model):
    """A regulator with an inner field-voltage loop, fed by terminal voltage, current or both.

        V_t ->[1/(1+sTR)]-> V_C
        V_ref - V_C + v_s ->[VImin..VImax]->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]-> V_R  (VRmin..VRmax)
        V_R ->(+)->[KM/(1+sTM)]-> V_M ->(x)-+-> E_fd     V_B = min(V_E F_EX(KC I_fd / V_E), VBmax)
             -^    VMmin..VMmax          ^  |            V_E = |KP exp(j thetaP) V_t
              +--[..VGmax]<-[KG]<-------V_B-+                  + j(KI + KP exp(j thetaP) XL) I_t|

    V_R's and V_M's limits are non-windup, the others clip. TR = 0, TA = 0, TM = 0 and TB = TC = 0
    bypass their blocks; the inner loop that TM = 0 makes algebraic is solved exactly. I_t is out of
    the machine, on its base. Not modelled: underexcitation limiter at the gate, load compensation.
    """

    key = "st3a"
    role = "exciter"
    source = "IEEE Std 421.5-2005, section 7.3, figure 7-3; 421.5-2016, Annex D (F_EX)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "TR": 0.0, "VImax": 0.2, "VImin": -0.2, "TC": 1.0, "TB": 10.0, "KA": 200.0, "TA": 0.0,
            "VRmax": 10.0, "VRmin": -10.0, "KM": 7.93, "TM": 0.4, "VMmax": 1.0, "VMmin": 0.0,
            "KG": 1.0, "VGmax": 5.8, "KP": 6.15, "theta_P": 0.0, "KI": 0.0, "XL": 0.081, "KC": 0.2,
            "VBmax": 6.9,
        }
    )  # fmt: skip
    example_source = "sample data of IEEE Std 421.5-2005, Annex H (potential source)"
    equations = (
        Equation(equations, ("vt", "v_s", "Vref", "v_re", "v_im", "i_re", "i_im", "Ifd"), ("Efd",)),
    )

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the lead-lag, the limits or the sources."""
        wrong = leads_without_lags(values, [("TC", "TB")])
        wrong += checks.order(values, "VRmin", "VRmax") + checks.order(values, "VMmin", "VMmax")
        if values["KP"] == 0 == values["KI"]:
            wrong.append("needs KP > 0 or KI > 0: without either there is no supply")
        return wrong

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return E_fd over v_s, V_ref and, through the transducer alone, V_t."""
        signals = {name: np.array([value]) for name, value in at.items()}
        V_B = float(supply_at(signals, np.array([[p[item.symbol]] for item in PARAMETERS]))[0])
        forward = lead_lag_at(s, p["TC"], p["TB"]) * p["KA"] / (1 + s * p["TA"])
        inner = V_B * p["KM"] / (1 + s * p["TM"])
        return excitation.over_error(forward * inner / (1 + p["KG"] * inner), s, p)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        Efd = signals["Efd"]
        V_M = Efd / supply_at(signals, p)
        V_R = V_M / p[P.KM] + np.minimum(p[P.KG] * Efd, p[P.VGmax])
        error = V_R / p[P.KA]
        require_within("V_M", V_M, p[P.VMmin], p[P.VMmax])
        require_within("V_R", V_R, p[P.VRmin], p[P.VRmax])
        require_within("V_I", error, p[P.VImin], p[P.VImax])
        signals["Vref"][:] = signals["vt"] + error
        return np.array([signals["vt"], error, V_R, V_M])
