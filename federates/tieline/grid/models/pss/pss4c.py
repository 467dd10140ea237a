"""PSS4C, the multi-band power system stabiliser of IEEE Std 421.5, with PSS4B."""

from collections.abc import Mapping
from math import pi, sqrt
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    gain_lead_lag,
    lag,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    rate_or_zero,
    second_order,
    second_order_at,
    washout,
)

BANDS = {"VL": "very low", "L": "low", "I": "intermediate", "H": "high"}
BRANCHES = tuple((band, number) for band in BANDS for number in (1, 2))
N_BANDS, N_BRANCHES, N_HIGH = len(BANDS), len(BRANCHES), 2

SPEED_LEAD_S = -1.759e-3
SPEED_LAG = (1.7823e-2, 1.2739e-4)
"""The speed transducer is (1 + s lead) / (1 + s lag_1 + s^2 lag_2)."""
POWER_WASHOUT_S, POWER_LAG_S = 1.0, 1.0 / 80.0


def _names(letter: str, first: int, second: int) -> list[str]:
    """Return one symbol a branch: number `first` for branch 1 of a band, `second` for branch 2."""
    return [f"{letter}{band}{number}" for band in BANDS for number in (first, second)]


BRANCH_GAINS, FIRST_GAINS = _names("K", 1, 2), _names("K", 11, 17)
FIRST = list(zip(_names("T", 1, 7), _names("T", 2, 8), strict=True))
SECOND = list(zip(_names("T", 3, 9), _names("T", 4, 10), strict=True))
THIRD = list(zip(_names("T", 5, 11), _names("T", 6, 12), strict=True))
NOTCHES = ("L1", "L2", "H1", "H2")


def _stage(text: str, pairs: list[tuple[str, str]], default: float | None) -> list[Parameter]:
    leads = [Parameter(n, "s", f"{text} lead", at_least=0, default=default) for n, _ in pairs]
    lags = [Parameter(n, "s", f"{text} lag", at_least=0, default=default) for _, n in pairs]
    return [*leads, *lags]


# Rows of one kind stand together, so that a line of the equations serves all eight branches.
PARAMETERS = (
    *(Parameter(f"K{band}", "pu", f"gain of the {text} band") for band, text in BANDS.items()),
    *(Parameter(name, "pu", "gain of a branch of the differential filter")
      for name in BRANCH_GAINS),
    *(Parameter(name, "pu", "gain at rest of the first lead-lag", default=1)
      for name in FIRST_GAINS),
    *_stage("first", FIRST, None),
    *_stage("second", SECOND, 0),
    *_stage("third", THIRD, 0),
    *(Parameter(f"V{band}max", "pu", f"upper limit of the {text} band", at_least=0)
      for band, text in BANDS.items()),
    *(Parameter(f"V{band}min", "pu", f"lower limit of the {text} band", at_most=0)
      for band, text in BANDS.items()),
    *(Parameter(f"wn{at}", "rad_s", "frequency of a notch filter; 0 for none", at_least=0,
                default=0) for at in NOTCHES),
    *(Parameter(f"Bw{at}", "rad_s", "3 dB bandwidth of a notch filter", at_least=0, default=0)
      for at in NOTCHES),
    Parameter("H", "s", "inertia constant of the machine", above=0),
    Parameter("VSTmax", "pu", "upper output limit", above=0),
    Parameter("VSTmin", "pu", "lower output limit", below=0),
)  # fmt: skip
STATES = (
    *(f"{kind}_{band}{number}" for kind in ("first", "second", "third")
      for band, number in BRANCHES),
    "speed", "speed_rate", "power_washout", "power_integral", "power_lag",
    *(f"notch_{at}{part}" for at in NOTCHES for part in ("", "_rate")),
)  # fmt: skip

P = indices(PARAMETERS)
X = indices(STATES)


@compiled
def transduce(d_omega: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return the speed deviation of the low and intermediate bands, before notch filters."""
    whole = np.ones_like(d_omega)
    lead, lag_1, lag_2 = SPEED_LEAD_S * whole, SPEED_LAG[0] * whole, SPEED_LAG[1] * whole
    y, dx[X.speed], dx[X.speed_rate] = second_order(
        d_omega, x[X.speed], x[X.speed_rate], (lead, 0.0 * whole), (lag_1, lag_2)
    )
    return y


@compiled
def integrate_power(Pe: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return the speed deviation of the high band, before notch filters."""
    whole = np.ones_like(Pe)
    high, dx[X.power_washout] = washout(Pe, x[X.power_washout], POWER_WASHOUT_S * whole)
    accelerating = -0.5 * POWER_WASHOUT_S / p[P.H] * high
    slow, dx[X.power_integral] = lag(accelerating, x[X.power_integral], POWER_WASHOUT_S * whole)
    y, dx[X.power_lag] = lag(slow, x[X.power_lag], POWER_LAG_S * whole)
    return y


@compiled
def notch_twice(u: Array, x: Array, p: Array, dx: Array, of: int, first: int) -> Array:
    """Return `u` after notches `of` and `of + 1`, whose states begin at row `first`."""
    for at in range(2):
        wn, Bw = p[P.wnL1 + of + at], p[P.BwL1 + of + at]
        square = rate_or_zero(np.ones_like(wn), wn * wn)
        row = first + 2 * at
        u, dx[row], dx[row + 1] = second_order(
            u, x[row], x[row + 1], (0.0 * wn, square), (Bw * square, square)
        )
    return u


@compiled
def filter_bands(low: Array, high: Array, x: Array, p: Array, dx: Array) -> Array:
    """Return the limited sum of all bands; `high` feeds the high one, `low` the others.

    All branches of all units stand in one row of N_BRANCHES n numbers.
    """
    n = len(low)
    u = np.empty(N_BRANCHES * n)
    for i in range(len(u)):
        u[i] = low[i % n] if i < (N_BRANCHES - N_HIGH) * n else high[i % n]
    K, T1, T2 = _rows(p, P.KVL11), _rows(p, P.TVL1), _rows(p, P.TVL2)
    u, rate = gain_lead_lag(u, _rows(x, X.first_VL1), K, T1, T2)
    dx[X.first_VL1 : X.first_VL1 + N_BRANCHES] = rate.reshape(N_BRANCHES, n)
    T3, T4 = _rows(p, P.TVL3), _rows(p, P.TVL4)
    u, rate = lead_lag_or_pass(u, _rows(x, X.second_VL1), T3, T4)
    dx[X.second_VL1 : X.second_VL1 + N_BRANCHES] = rate.reshape(N_BRANCHES, n)
    T5, T6 = _rows(p, P.TVL5), _rows(p, P.TVL6)
    u, rate = lead_lag_or_pass(u, _rows(x, X.third_VL1), T5, T6)
    dx[X.third_VL1 : X.third_VL1 + N_BRANCHES] = rate.reshape(N_BRANCHES, n)
    branches = (_rows(p, P.KVL1) * u).reshape(N_BRANCHES, n)
    total = np.zeros(n)
    for band in range(N_BANDS):
        difference = p[P.KVL + band] * (branches[2 * band] - branches[2 * band + 1])
        total += clamp(difference, p[P.VVLmin + band], p[P.VVLmax + band])
    return clamp(total, p[P.VSTmin], p[P.VSTmax])


@compiled
def _rows(matrix: Array, first: int) -> Array:
    """Return the rows of all branches from `first` on, one after the other, (N_BRANCHES n,)."""
    return np.ascontiguousarray(matrix[first : first + N_BRANCHES]).reshape(-1)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write v_s from the unit's own speed deviation and electrical power."""
    low = notch_twice(transduce(u[0] - u[1], x, p, dx), x, p, dx, 0, X.notch_L1)
    high = notch_twice(integrate_power(u[2], x, p, dx), x, p, dx, 2, X.notch_H1)
    y[0] = filter_bands(low, high, x, p, dx)


def transducers_at(s: complex, p: Mapping[str, float]) -> dict[str, complex]:
    """Return the low bands' signal over speed and the high band's over power, at `s`."""
    speed = second_order_at(s, SPEED_LEAD_S, 0.0, *SPEED_LAG)
    power = -s / (1 + s * POWER_WASHOUT_S) ** 2 / (1 + s * POWER_LAG_S) / (2 * p["H"])
    found = {"omega": speed, "Pe": power}
    for at in NOTCHES:
        if p[f"wn{at}"] > 0:
            square = p[f"wn{at}"] ** -2
            of = "omega" if at.startswith("L") else "Pe"
            found[of] *= second_order_at(s, 0.0, square, p[f"Bw{at}"] * square, square)
    return found


def band_at(s: complex, p: Mapping[str, float], band: str) -> complex:
    """Return a band's output over its transducer's signal at `s`, inside the limits."""
    difference = 0j
    for sign, (K, K1, T1) in ((1, ("1", "11", 1)), (-1, ("2", "17", 7))):
        lead, lag_ = p[f"T{band}{T1}"], p[f"T{band}{T1 + 1}"]
        shape = (p[f"K{band}{K1}"] + s * lead) / (1 + s * lag_)
        for at in (T1 + 2, T1 + 4):
            shape *= lead_lag_at(s, p[f"T{band}{at}"], p[f"T{band}{at + 1}"])
        difference += sign * p[f"K{band}{K}"] * shape
    return p[f"K{band}"] * difference


def simple_band(band: str, f_hz: float, K: float, limit: float, R: float = 1.2) -> dict[str, float]:
    """Return the parameters of a band by the standard's simplified rule.

    Two lead-lags whose difference peaks at `f_hz` with gain `K` and phase zero; R is the ratio of
    neighbouring time constants.
    """
    T = 1.0 / (2.0 * pi * f_hz * sqrt(R))
    gain = (R * R + R) / (R * R - 2.0 * R + 1.0)
    values = {f"T{band}{number}": 0.0 for number in range(1, 13)}
    values |= {f"T{band}1": T / R, f"T{band}2": T, f"T{band}7": T, f"T{band}8": T * R}
    values |= {f"K{band}": K, f"K{band}1": gain, f"K{band}2": gain}
    values |= {f"K{band}11": 1.0, f"K{band}17": 1.0}
    return values | {f"V{band}max": limit, f"V{band}min": -limit}


class PSS4C(Model):
    """Four differential band-pass filters on two measurements of the speed, each with its limit.

        omega - w0 ->[(1 - 1.759e-3 s)/(1 + 1.7823e-2 s + 1.2739e-4 s^2)]->[notches L1, L2]-> low
        Pe ->[80 s^2/(s^3 + 82 s^2 + 161 s + 80)]->[-1/(2 H s)]->[notches H1, H2]-> high

        band X: u -+->[KX1]->[(KX11+sTX1)/(1+sTX2)]->[(1+sTX3)/(1+sTX4)]->[(1+sTX5)/(1+sTX6)]->(+)
                   +->[KX2]->[(KX17+sTX7)/(1+sTX8)]->[(1+sTX9)/(1+sTX10)]->[..TX11/TX12]---->(-)
                (sum) ->[KX]->[VXmin, VXmax]->                  u is high for X = H, else low

        v_s = the sum of bands VL, L, I and H, limited to [VSTmin, VSTmax]

    Pe counts on the machine base. A notch (s^2 + wn^2)/(s^2 + Bw s + wn^2) with wn = 0 and a
    lead-lag whose both constants are 0 are bypassed (of the first one its gain KX11 or KX17
    remains). KX = 0 takes band X out. Limits clip, the states go on. PSS4B is the case KVL = 0.
    The power path is realised as s/(1+s)^2 1/(1+s/80) (-1/2H), which is the same.

    Not modelled: the sampling of the digital transducers that the first blocks stand for.
    """

    key = "pss4c"
    role = "pss"
    source = "IEEE Std 421.5-2016, clause 9, type PSS4C (PSS4B: 421.5-2005, 8.4)"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            **simple_band("VL", 0.01, 0.5, 0.01), **simple_band("L", 0.07, 7.5, 0.075),
            **simple_band("I", 0.7, 30.0, 0.6), **simple_band("H", 8.0, 120.0, 0.6),
            **{f"{name}{at}": 0.0 for name in ("wn", "Bw") for at in NOTCHES},
            "H": 5.0, "VSTmax": 0.15, "VSTmin": -0.15,
        }
    )  # fmt: skip
    example_source = (
        "typical values of IEC 61970-302, class PssIEEE4B (the simplified rule at 0.07, 0.7 and "
        "8 Hz with R = 1.2), with a very low band at 0.01 Hz of tieline's own"
    )
    equations = (Equation(equations, ("omega", "w0", "Pe"), ("v_s",)),)

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return v_s over speed and over electrical power."""
        found = transducers_at(s, p)
        low = sum(band_at(s, p, band) for band in BANDS if band != "H")
        return {
            ("omega", "v_s"): low * found["omega"],
            ("Pe", "v_s"): band_at(s, p, "H") * found["Pe"],
        }

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return leads without lags, and notches that would ring for ever."""
        wrong = leads_without_lags(values, [*FIRST, *SECOND, *THIRD])
        for at in NOTCHES:
            wn, Bw = values[f"wn{at}"], values[f"Bw{at}"]
            if (wn > 0) is not (Bw > 0):
                wrong.append(f"needs wn{at} and Bw{at} both > 0, or both 0 (got {wn:g}, {Bw:g})")
        return wrong

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest: the washout of the power holds it, the rest is zero."""
        x = np.zeros((len(STATES), p.shape[1]))
        x[X.power_washout] = signals["Pe"]
        return x
