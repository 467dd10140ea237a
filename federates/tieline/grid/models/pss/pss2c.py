"""PSS2C, the dual-input power system stabiliser of IEEE Std 421.5, with PSS2A and PSS2B."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    washout,
    washout_at,
    washout_or_pass,
    where_positive,
)

LEAD_LAGS = (("T1", "T2"), ("T3", "T4"), ("T10", "T11"), ("T12", "T13"))
RAMP_LAGS = 8
SWITCHING_S = 0.02
"""Time constant of the output switch; it acts 14 ms after the power has crossed a threshold."""
NEVER = -100.0

PARAMETERS = (
    Parameter("KS1", "pu", "gain"),
    Parameter("KS2", "pu", "gain of the power signal; T7 / (2 H) makes it a speed"),
    Parameter("KS3", "pu", "share of the power signal in the ramp-tracking filter"),
    Parameter("Tw1", "s", "first washout of the speed", above=0),
    Parameter("Tw2", "s", "second washout of the speed", at_least=0, default=0),
    Parameter("Tw3", "s", "first washout of the power", above=0),
    Parameter("Tw4", "s", "second washout of the power", at_least=0, default=0),
    Parameter("T6", "s", "transducer of the speed", at_least=0, default=0),
    Parameter("T7", "s", "transducer of the power", at_least=0),
    Parameter("T8", "s", "lead of the ramp-tracking filter", at_least=0),
    Parameter("T9", "s", "lag of the ramp-tracking filter", at_least=0),
    Parameter("M", "1", "lags for each lead of the ramp-tracking filter", at_least=1),
    Parameter("N", "1", "order of the ramp-tracking filter", at_least=0),
    Parameter("T1", "s", "first lead", at_least=0),
    Parameter("T2", "s", "first lag", at_least=0),
    Parameter("T3", "s", "second lead", at_least=0),
    Parameter("T4", "s", "second lag", at_least=0),
    Parameter("T10", "s", "third lead", at_least=0, default=0),
    Parameter("T11", "s", "third lag", at_least=0, default=0),
    Parameter("T12", "s", "fourth lead", at_least=0, default=0),
    Parameter("T13", "s", "fourth lag", at_least=0, default=0),
    Parameter("VSI1max", "pu", "upper limit of the speed deviation", above=0),
    Parameter("VSI1min", "pu", "lower limit of the speed deviation", below=0),
    Parameter("VSI2max", "pu", "upper limit of the power"),
    Parameter("VSI2min", "pu", "lower limit of the power"),
    Parameter("VSTmax", "pu", "upper output limit", above=0),
    Parameter("VSTmin", "pu", "lower output limit", below=0),
    Parameter("PPSSon", "pu", "power above which the output is switched on", default=NEVER),
    Parameter("PPSSoff", "pu", "power below which the output is switched off", default=NEVER),
)
STATES = (
    "speed_1", "speed_2", "speed", "power_1", "power_2", "power",
    *(f"ramp_{stage}" for stage in range(1, RAMP_LAGS + 1)),
    "first", "second", "third", "fourth", "is_on",
)  # fmt: skip

P = indices(PARAMETERS)
X = indices(STATES)


@compiled
def track_ramps(u: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return [(1 + s T8) / (1 + s T9)^M]^N of `u`: N M lags, the first N of them with a lead."""
    none = np.zeros_like(u)
    for stage in range(RAMP_LAGS):
        lead = where_positive(p[P.N] - stage, p[P.T8], none)
        lag = where_positive(p[P.N] * p[P.M] - stage, p[P.T9], none)
        row = X.ramp_1 + stage
        u, dx[row] = lead_lag_or_pass(u, x[row], lead, lag)
    return u


@compiled
def accelerating_power(d_omega: Array, Pe: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return the speed deviation that the integral of accelerating power stands for, pu."""
    speed = clamp(d_omega, p[P.VSI1min], p[P.VSI1max])
    speed, dx[X.speed_1] = washout(speed, x[X.speed_1], p[P.Tw1])
    speed, dx[X.speed_2] = washout_or_pass(speed, x[X.speed_2], p[P.Tw2])
    speed, dx[X.speed] = lag_or_pass(speed, x[X.speed], p[P.T6])
    power = clamp(Pe, p[P.VSI2min], p[P.VSI2max])
    power, dx[X.power_1] = washout(power, x[X.power_1], p[P.Tw3])
    power, dx[X.power_2] = washout_or_pass(power, x[X.power_2], p[P.Tw4])
    power, dx[X.power] = lag_or_pass(p[P.KS2] * power, x[X.power], p[P.T7])
    return track_ramps(speed + p[P.KS3] * power, x, p, dx) - power


@compiled
def compensate(signal: Array, Pe: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return v_s: gain, lead-lags, limits and the switch that heeds the electrical power."""
    v, dx[X.first] = lead_lag_or_pass(p[P.KS1] * signal, x[X.first], p[P.T1], p[P.T2])
    v, dx[X.second] = lead_lag_or_pass(v, x[X.second], p[P.T3], p[P.T4])
    v, dx[X.third] = lead_lag_or_pass(v, x[X.third], p[P.T10], p[P.T11])
    v, dx[X.fourth] = lead_lag_or_pass(v, x[X.fourth], p[P.T12], p[P.T13])
    is_on, none = x[X.is_on], np.zeros_like(v)
    held = where_positive(p[P.PPSSoff] - Pe, none, is_on)
    towards = where_positive(Pe - p[P.PPSSon], none + 1.0, held)
    dx[X.is_on] = (towards - is_on) / SWITCHING_S
    return where_positive(is_on - 0.5, clamp(v, p[P.VSTmin], p[P.VSTmax]), none)


def front_at(s: complex, p: Mapping[str, float]) -> tuple[complex, complex]:
    """Return the synthesised speed over speed and over power at `s`, inside the limits."""
    speed = washout_at(s, p["Tw1"]) * washout_at(s, p["Tw2"]) / (1 + s * p["T6"])
    power = p["KS2"] * washout_at(s, p["Tw3"]) * washout_at(s, p["Tw4"]) / (1 + s * p["T7"])
    ramp = ((1 + s * p["T8"]) / (1 + s * p["T9"]) ** int(p["M"])) ** int(p["N"])
    return ramp * speed, (ramp * p["KS3"] - 1) * power


def compensation(s: complex, p: Mapping[str, float]) -> complex:
    """Return v_s over the synthesised speed at `s`, inside the limits, switched on."""
    forward: complex = p["KS1"]
    for lead, lag in LEAD_LAGS:
        forward *= lead_lag_at(s, p[lead], p[lag])
    return forward


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed deviation and electrical power."""
    y[0] = compensate(accelerating_power(u[0] - u[1], u[2], x, p, dx), u[2], x, p, dx)


class PSS2C(Model):
    """A stabiliser on the integral of accelerating power, made of speed and electrical power.

        omega - w0 ->[VSI1]->[sTw1/(1+sTw1)]->[sTw2/(1+sTw2)]->[1/(1+sT6)]--->(+)->[R]->(+)--> S
        Pe --------->[VSI2]->[sTw3/(1+sTw3)]->[sTw4/(1+sTw4)]->[KS2/(1+sT7)]-+->[KS3]^   ^-
                                                                             +-----------+
        R = [(1+sT8)/(1+sT9)^M]^N, the ramp-tracking filter
        S ->[KS1]->[(1+sT1)/(1+sT2)]->[(1+sT3)/(1+sT4)]->[(1+sT10)/(1+sT11)]->[(1+sT12)/(1+sT13)]
            ->[VSTmin, VSTmax]->[switch]-> v_s

    Pe counts on the machine base. Bypassed: a second washout whose constant is 0, a transducer
    whose constant is 0 (KS2 stays), a lead-lag or the ramp-tracking filter whose both constants
    are 0, and that filter also with N = 0. The filter may have up to eight lags, N M <= 8. The
    switch lets the output through once Pe exceeds PPSSon, blocks it once Pe falls below PPSSoff,
    and keeps its position between; at the start it blocks below PPSSoff only. The standard's
    switch acts at once, this one after 14 ms. Limits clip, the states go on.

    PSS2B is the case T12 = T13 = 0 without thresholds, PSS2A the same with T10 = T11 = 0 and input
    limits out of reach. Not modelled: inputs other than rotor speed and electrical power
    (terminal or compensated frequency).
    """

    key = "pss2c"
    role = "pss"
    source = "IEEE Std 421.5-2016, clause 9, type PSS2C (PSS2B: 421.5-2005, 8.2)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "KS1": 12.0, "KS2": 0.2, "KS3": 1.0, "Tw1": 2.0, "Tw2": 2.0, "Tw3": 2.0, "Tw4": 0.0,
            "T6": 0.0, "T7": 2.0, "T8": 0.5, "T9": 0.1, "M": 5.0, "N": 1.0, "T1": 0.12, "T2": 0.02,
            "T3": 0.3, "T4": 0.02, "T10": 0.0, "T11": 0.0, "T12": 0.0, "T13": 0.0, "VSI1max": 2.0,
            "VSI1min": -2.0, "VSI2max": 2.0, "VSI2min": -2.0, "VSTmax": 0.1, "VSTmin": -0.1,
            "PPSSon": 0.1, "PPSSoff": 0.05,
        }
    )  # fmt: skip
    example_source = (
        "typical values of IEC 61970-302, class PssIEEE2B, but T8 = M T9 so that ramps are "
        "tracked, with thresholds of tieline's own"
    )
    equations = (Equation(equations, ("omega", "w0", "Pe"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over speed and over electrical power, switched on."""
        speed, power = front_at(s, p)
        forward = compensation(s, p)
        return {("omega", "v_s"): forward * speed, ("Pe", "v_s"): forward * power}

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return leads without lags, a filter that has no such order, limits that cross."""
        wrong = leads_without_lags(values, (*LEAD_LAGS, ("T8", "T9")))
        M, N = values["M"], values["N"]
        if int(M) != M or int(N) != N or M * N > RAMP_LAGS:
            wrong.append(f"needs whole M and N with N M <= {RAMP_LAGS} (got M = {M:g}, N = {N:g})")
        for low, high in (("VSI2min", "VSI2max"), ("PPSSoff", "PPSSon")):
            if values[low] > values[high]:
                given = f"{values[low]:g} and {values[high]:g}"
                wrong.append(f"needs {low} <= {high} (got {given})")
        return wrong

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: the washout of the power holds it, the rest is zero."""
        x = np.zeros((len(STATES), p.shape[1]))
        x[X.power_1] = clamp(signals["Pe"], p[P.VSI2min], p[P.VSI2max])
        x[X.is_on] = np.where(signals["Pe"] < p[P.PPSSoff], 0.0, 1.0)
        return x
