"""DC1A, the field-controlled DC commutator exciter of IEEE Std 421.5."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models import checks, excitation
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    limited_integrator,
    limited_lag,
    rate_feedback,
)
from tieline.grid.models.characteristics import saturation, saturation_slope
from tieline.grid.models.limits import require_within

PARAMETERS = (
    excitation.TR, excitation.TC, excitation.TB, excitation.KA, excitation.TA,
    excitation.VRmax, excitation.VRmin, excitation.TE, excitation.KE, excitation.KF, excitation.TF,
    excitation.E1, excitation.SE1, excitation.E2, excitation.SE2,
    Parameter("Efdmin", "pu", "lower limit of the field voltage"),
)  # fmt: skip
STATES = ("V_C", "V_A", "V_R", "E_fd", "V_F")

P = indices(PARAMETERS)
X = indices(STATES)


@compiled
def excite(x: Array, u: Array, p: Array, dx: Array, supply: Array) -> Array:
    """Return E_fd and write all derivatives; `supply` (n,) scales the regulator's limits."""
    Efd, low = x[X.E_fd], supply * p[P.VRmin]
    V_C, dx[X.V_C] = lag_or_pass(u[0], x[X.V_C], p[P.TR])
    V_F, dx[X.V_F] = rate_feedback(Efd, x[X.V_F], p[P.KF], p[P.TF])
    V_A, dx[X.V_A] = lead_lag_or_pass(u[2] - V_C + u[1] - V_F, x[X.V_A], p[P.TC], p[P.TB])
    V_R, dx[X.V_R] = limited_lag(V_A, x[X.V_R], p[P.KA], p[P.TA], low, supply * p[P.VRmax])
    S = saturation(np.abs(Efd), p[P.E1], p[P.SE1], p[P.E2], p[P.SE2])
    rate = (V_R - (p[P.KE] + S) * Efd) / p[P.TE]
    y, dx[X.E_fd] = limited_integrator(rate, Efd, p[P.Efdmin], np.full_like(Efd, np.inf))
    return y


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write E_fd from V_t, v_s and V_ref."""
    y[0] = excite(x, u, p, dx, np.ones_like(u[0]))


class DC1A(Model):
    """A regulator with fixed limits that drives the field of a saturating DC exciter.

        V_t ->[1/(1+sTR)]-> V_C
        V_ref - V_C + v_s - V_F ->[(1+sTC)/(1+sTB)]->[KA/(1+sTA)]-> V_R ->(+)->[1/(sTE)]-> E_fd
                                                     VRmin..VRmax        -^      Efdmin..   |
        V_F <-[sKF/(1+sTF)]<- E_fd                        KE E_fd + SE(E_fd) E_fd <---------+

    All limits are non-windup. TR = 0, TA = 0 and TB = TC = 0 bypass their blocks. SE is the scaled
    quadratic through (E1, SE1) and (E2, SE2), E1 < E2. K_E is taken as given: the standard's option
    of K_E = 0 for 'computed so that V_R starts at 0' is not offered. Not modelled: under- and
    overexcitation limiter inputs, load compensation, effect of speed.
    """

    key = "dc1a"
    role = "exciter"
    source = "IEEE Std 421.5-2005, section 5.1, figure 5-1; DC1C of 421.5-2016 adds limiter inputs"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "TR": 0.0, "TC": 0.0, "TB": 0.0, "KA": 46.0, "TA": 0.06, "VRmax": 1.0, "VRmin": -0.9,
            "TE": 0.46, "KE": 0.0, "KF": 0.1, "TF": 1.0, "E1": 2.3, "SE1": 0.1, "E2": 3.1,
            "SE2": 0.33, "Efdmin": 0.0,
        }
    )  # fmt: skip
    example_source = "sample data of IEEE Std 421.5-2005, Annex H, with K_E = 0"
    equations = (Equation(equations, ("vt", "v_s", "Vref"), ("Efd",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the lead-lag, the limits or the points of saturation."""
        return [
            *leads_without_lags(values, [("TC", "TB")]),
            *checks.order(values, "VRmin", "VRmax"),
            *checks.saturation(values, "E1", "SE1", "E2", "SE2"),
        ]

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return E_fd over v_s, V_ref and V_t."""
        slope = saturation_slope(at["Efd"], p["E1"], p["SE1"], p["E2"], p["SE2"])
        regulator = lead_lag_at(s, p["TC"], p["TB"]) * p["KA"] / (1 + s * p["TA"])
        forward = regulator / (s * p["TE"] + p["KE"] + slope)
        feedback = s * p["KF"] / (1 + s * p["TF"])
        return excitation.over_error(forward / (1 + forward * feedback), s, p)

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's E_fd, and set V_ref."""
        return cls.at_rest(signals, p, np.ones_like(signals["vt"]))

    @staticmethod
    def at_rest(signals: dict[str, Array], p: Array, supply: Array) -> Array:
        """Return the states at rest, and set V_ref; `supply` (n,) scales the regulator's limits."""
        Efd = signals["Efd"]
        require_within("Efd", Efd, p[P.Efdmin], np.inf)
        S = saturation(np.abs(Efd), p[P.E1], p[P.SE1], p[P.E2], p[P.SE2])
        V_R = (p[P.KE] + S) * Efd
        require_within("V_R", V_R, supply * p[P.VRmin], supply * p[P.VRmax])
        error = V_R / p[P.KA]
        signals["Vref"][:] = signals["vt"] + error
        return np.array([signals["vt"], error, V_R, Efd, Efd])
