"""IEEEG1, the general steam turbine governor of PES-TR1."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.grid.models import checks
from tieline.grid.models.base import Array, Equation, Model, Parameter, indices
from tieline.grid.models.blocks import (
    clamp,
    lag_or_pass,
    lead_lag_at,
    lead_lag_or_pass,
    leads_without_lags,
    limited_integrator,
)
from tieline.grid.models.characteristics import deadband
from tieline.grid.models.limits import require_within

_SHARES = tuple(f"K{number}" for number in range(1, 9))
PARAMETERS = (
    Parameter("K", "pu", "gain 1/R, power per speed", at_least=0),
    Parameter("db1", "pu", "half width of the deadband of speed", at_least=0),
    Parameter("T1", "s", "lag of the governor; T1 = T2 = 0 bypass it", at_least=0),
    Parameter("T2", "s", "lead of the governor", at_least=0),
    Parameter("T3", "s", "valve positioner time constant", above=0),
    Parameter("Uo", "pu_s", "largest opening speed of the valve", above=0),
    Parameter("Uc", "pu_s", "largest closing speed of the valve", below=0),
    Parameter("PMAX", "pu", "upper limit of the valve", above=0),
    Parameter("PMIN", "pu", "lower limit of the valve"),
    Parameter("T4", "s", "steam chest and inlet piping; 0 bypasses it", at_least=0),
    Parameter("T5", "s", "first reheater; 0 bypasses it", at_least=0),
    Parameter("T6", "s", "second reheater; 0 bypasses it", at_least=0),
    Parameter("T7", "s", "crossover; 0 bypasses it", at_least=0),
    *(
        Parameter(name, "1", f"share of power after T{4 + at // 2}", at_least=0)
        for at, name in enumerate(_SHARES)
    ),
)
STATES = ("governor", "valve", "chest", "first", "second", "crossover")

P = indices(PARAMETERS)
X = indices(STATES)


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write P_m from speed and reference."""
    d_omega = deadband(u[0] - u[2], p[P.db1])
    droop, dx[X.governor] = lead_lag_or_pass(p[P.K] * d_omega, x[X.governor], p[P.T2], p[P.T1])
    rate = clamp((u[1] - droop - x[X.valve]) / p[P.T3], p[P.Uc], p[P.Uo])
    valve, dx[X.valve] = limited_integrator(rate, x[X.valve], p[P.PMIN], p[P.PMAX])
    chest, dx[X.chest] = lag_or_pass(valve, x[X.chest], p[P.T4])
    first, dx[X.first] = lag_or_pass(chest, x[X.first], p[P.T5])
    second, dx[X.second] = lag_or_pass(first, x[X.second], p[P.T6])
    last, dx[X.crossover] = lag_or_pass(second, x[X.crossover], p[P.T7])
    y[0] = (
        (p[P.K1] + p[P.K2]) * chest
        + (p[P.K3] + p[P.K4]) * first
        + (p[P.K5] + p[P.K6]) * second
        + (p[P.K7] + p[P.K8]) * last
    )


class IEEEG1(Model):
    """A droop governor, a rate-limited valve and up to four turbine stages.

        d_omega = omega - w0 ->[deadband db1]->[K(1+sT2)/(1+sT1)]-> droop
        P_ref - droop - valve ->[1/T3]->[Uc..Uo]->[1/s]-> valve     (PMIN..PMAX, non-windup)
        valve ->[1/(1+sT4)]-+->[1/(1+sT5)]-+->[1/(1+sT6)]-+->[1/(1+sT7)]-+
                         K1+K2          K3+K4          K5+K6          K7+K8 -> sum -> P_m

    Overspeed closes the valve. Both shafts' shares act on this one machine, a tandem-compound unit;
    K1 to K8 sum to 1. T1 = T2 = 0 and T4 to T7 = 0 bypass their blocks. The deadband has no step at
    its edges. Not modelled: the second machine of a cross-compound unit, curve of the valve.
    """

    key = "ieeeg1"
    role = "governor"
    source = (
        "IEEE PES-TR1, Dynamic Models for Turbine-Governors, 2013, steam turbines (IEEEG1); IEEE "
        "Committee Report, Trans. PAS-92, 1973, p. 1904"
    )
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "K": 25.0, "db1": 0.0, "T1": 0.0, "T2": 0.0, "T3": 0.1, "Uo": 1.0, "Uc": -10.0,
            "PMAX": 1.0, "PMIN": 0.0, "T4": 0.3, "T5": 5.0, "T6": 0.5, "T7": 0.0, "K1": 0.2,
            "K2": 0.0, "K3": 0.3, "K4": 0.0, "K5": 0.5, "K6": 0.0, "K7": 0.0, "K8": 0.0,
        }
    )  # fmt: skip
    example_source = "typical values of IEC 61970-302, class GovSteamIEEE1, without deadband"
    equations = (Equation(equations, ("omega", "Pref", "w0"), ("Pm",)),)

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the lead-lag, the limits or the sum of the shares."""
        wrong = leads_without_lags(values, [("T2", "T1")]) + checks.order(values, "PMIN", "PMAX")
        total = math.fsum(values[name] for name in _SHARES)
        if abs(total - 1.0) > 1e-6:
            wrong.append(f"needs K1 + ... + K8 = 1 (got {total:g})")
        return wrong

    @classmethod
    def transfer(
        cls, s: complex, p: Mapping[str, float], at: Mapping[str, float]
    ) -> dict[tuple[str, str], complex]:
        """Return P_m over speed, inside a deadband of 0, and over P_ref."""
        steam, power = 1 / (1 + s * p["T3"]), 0j
        for stage in range(4):
            steam /= 1 + s * p[f"T{4 + stage}"]
            power += (p[f"K{2 * stage + 1}"] + p[f"K{2 * stage + 2}"]) * steam
        governor = p["K"] * lead_lag_at(s, p["T2"], p["T1"])
        return {("omega", "Pm"): -governor * power, ("Pref", "Pm"): power}

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states that give the machine's P_m, and set P_ref."""
        shares = p[[getattr(P, name) for name in _SHARES]].sum(axis=0)
        valve = signals["Pm"] / shares
        require_within("valve", valve, p[P.PMIN], p[P.PMAX])
        signals["Pref"][:] = valve
        return np.array([np.zeros_like(valve), valve, valve, valve, valve, valve])
