"""The generalised stabiliser on the integral of accelerating power, by the front end of PSS2C."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models.base import Array, Equation, Model, indices
from tieline.grid.models.blocks import washout, washout_at, washout_or_pass
from tieline.grid.models.pss import generalized_delta_omega, pss2c
from tieline.grid.models.pss.pss2c import PSS2C, accelerating_power, compensate

PARAMETERS = (*pss2c.PARAMETERS, *generalized_delta_omega.PARAMETERS[-2:])
STATES = (*pss2c.STATES, "average_1", "average_2")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed and power and the average that it believes."""
    omega, wbar, w0, Pe = u[0], u[1], u[2], u[3]
    own = accelerating_power(omega - w0, Pe, x, p, dx)
    average, dx[X.average_1] = washout(wbar - w0, x[X.average_1], p[P.Tw1])
    average, dx[X.average_2] = washout_or_pass(average, x[X.average_2], p[P.Tw2])
    nu = p[P.beta2] * own + (p[P.beta1] - p[P.beta2]) * (own - average)
    y[0] = compensate(nu, Pe, x, p, dx)


class GeneralizedPSS2C(Model):
    """The generalised stabiliser whose local speed is made of speed and electrical power.

    A shaft twists against itself at 10 to 50 Hz. A stabiliser on measured speed passes this on to
    the field, where it can feed the twist; a filter that stops it costs phase where the damping is
    needed. The speed of the whole shaft can be had without the measured one:

        2 H d(d_omega)/dt = Pm - Pe      so      d_omega = M - E,
                                                 M = int Pm / 2H,   E = int Pe / 2H

    E comes from electrical power, in which a twist hardly shows. M is not measured, but
    M = d_omega + E, and mechanical power is slow: it is at most a ramp. A low-pass R that follows
    ramps without error, R(0) = 1 and R'(0) = 0, thus keeps M and takes the twist off:

        own = R (d_omega + E) - E

    Below the corner of R, own is d_omega; above it own is -E, whatever the measured speed does.
    E is formed as KS2 / (1 + s T7) with KS2 = T7 / 2H, an integral above 1 / T7, and everything
    passes the washouts; so the average must pass those of the speed as well before it is compared:

        average = sTw1/(1+sTw1) sTw2/(1+sTw2) (wbar - w0)
        nu = beta1 (own - average) + beta2 average
           = beta2 own + (beta1 - beta2) (own - average)

    nu then passes gain, lead-lags, limits and switch of `pss2c`. With beta1 = beta2 the average
    drops out to the last bit, and with both 1 this is `pss2c`. R follows ramps where T8 = M T9.
    Not modelled: what is not modelled in `pss2c`.
    """

    key = "generalized_pss2c"
    role = "pss"
    source = (
        f"{generalized_delta_omega.SOURCE} (future work); front end: {PSS2C.source}; Kundur 1994, "
        "section 17.2.1, delta-P-omega stabiliser"
    )
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType({**PSS2C.example, "beta1": 1.0, "beta2": 0.5})
    example_source = f"{PSS2C.example_source}; betas: {generalized_delta_omega.EXAMPLE_SOURCE}"
    equations = (Equation(equations, ("omega", "wbar", "w0", "Pe"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over speed, average and electrical power, switched on."""
        speed, power = pss2c.front_at(s, p)
        forward = pss2c.compensation(s, p)
        average = washout_at(s, p["Tw1"]) * washout_at(s, p["Tw2"])
        return {
            ("omega", "v_s"): p["beta1"] * forward * speed,
            ("wbar", "v_s"): (p["beta2"] - p["beta1"]) * forward * average,
            ("Pe", "v_s"): p["beta1"] * forward * power,
        }

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what `pss2c` would refuse, and a filter that does not follow ramps."""
        wrong = PSS2C.check(values)
        if values["N"] > 0 and not np.isclose(values["T8"], values["M"] * values["T9"]):
            given = f"{values['T8']:g} s and {values['M']:g} x {values['T9']:g} s"
            wrong.append(f"needs T8 = M T9, so that the filter follows ramps (got {given})")
        return wrong

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: the washout of the power holds it, the rest is zero."""
        return np.concatenate([PSS2C.initialise(signals, p), np.zeros((2, p.shape[1]))])
