"""Our miniWECC in the words of DPsim: the same buses, branches, loads and units, in SI units.

What DPsim has no part for is left out: turns ratios and phase shifts of transformers are one and
zero, loads are impedances, HVDC lines are loads, and the operating point is that of this network.
"""

import csv
from dataclasses import replace
from typing import Any

import numpy as np

from tieline.grid.case import load_case
from tieline.grid.powerflow import solve_power_flow
from tieline.resources import case_folder

VOLTAGE_V, POWER_VA, OMEGA = 500e3, 100e6, 2 * np.pi * 60.0
IMPEDANCE_OHM = VOLTAGE_V**2 / POWER_VA
LEAST_OHM = 0.01
"""Resistance of a branch that has none: DPsim takes it as open. It is 4e-6 pu."""


def _pair(value: complex) -> list[float]:
    return [float(value.real), float(value.imag)]


def _rows(table: str) -> dict[str, dict[str, str]]:
    with (case_folder("miniwecc") / f"{table}.csv").open(encoding="utf-8") as file:
        return {row["unit"]: row for row in csv.DictReader(file)}


def like_case(tripped: str) -> dict[str, Any]:
    """Return the case as plain data.

    Args:
        tripped: the unit that has a breaker.
    """
    case = load_case(case_folder("miniwecc"))
    case = replace(case, branches=replace(case.branches, tap=np.ones_like(case.branches.tap)))
    flow = solve_power_flow(case)
    volts = flow.phasor * VOLTAGE_V
    branches, buses = case.branches, case.buses
    lines = [
        [
            int(branches.start[row]),
            int(branches.end[row]),
            max(float(branches.impedance[row].real * IMPEDANCE_OHM), LEAST_OHM),
            float(branches.impedance[row].imag * IMPEDANCE_OHM / OMEGA),
            float(branches.susceptance[row] / IMPEDANCE_OHM / OMEGA),
        ]
        for row in range(len(branches.start))
    ]
    shunt = (buses.g_shunt - 1j * buses.b_shunt) * flow.v**2
    drawn = (buses.p_load + 1j * buses.q_load + shunt) * POWER_VA
    loads = [[bus, *_pair(value), abs(volts[bus])] for bus, value in enumerate(drawn) if value]
    numbers = {int(number): place for place, number in enumerate(buses.number)}
    tables = {table: _rows(table) for table in ("machine", "exciter", "governor", "pss")}
    units = []
    for name, row in tables["machine"].items():
        bus = numbers[int(row["bus"])]
        power = complex(flow.p_gen[bus], flow.q_gen[bus]) * POWER_VA
        own = {table: rows[name] for table, rows in tables.items() if name in rows}
        unit = {"name": name, "bus": bus, "is_tripped": name == tripped, "volt": VOLTAGE_V}
        unit |= {"power": _pair(power), "voltage": _pair(volts[bus])}
        units.append(unit | _parameters(own))
    return {
        "buses": [[int(buses.number[bus]), _pair(volts[bus])] for bus in range(len(volts))],
        "branches": lines,
        "loads": loads,
        "units": units,
    }


SYMBOLS = {
    "machine": {
        "H": "H_s", "Ld": "xd_pu", "Lq": "xq_pu", "L0": "xl_pu", "Ld_t": "xd_p_pu",
        "Lq_t": "xq_p_pu", "Td0_t": "Td0_p_s", "Tq0_t": "Tq0_p_s", "Ld_s": "xd_pp_pu",
        "Lq_s": "xq_pp_pu", "Td0_s": "Td0_pp_s", "Tq0_s": "Tq0_pp_s",
    },
    "exciter": {
        "Ka": "KA_pu", "Te": "TA_s", "Tb": "TB_s", "Ta": "TC_s", "MaxEfd": "VRmax_pu",
        "MinEfd": "VRmin_pu",
    },
    "governor": {
        "T3": "T3_s", "T4": "T4_s", "T5": "T5_s", "Tc": "Tc_s", "Ts": "Ts_s", "Pmax": "Tmax_pu",
    },
    "pss": {
        "Kw": "K_pu", "Tw": "Tw_s", "T1": "T1_s", "T2": "T2_s", "T3": "T3_s", "T4": "T4_s",
        "Vs_max": "vsmax_pu", "Vs_min": "vsmin_pu",
    },
}  # fmt: skip
"""DPsim's symbol of each parameter that has one, and the column of our tables that it is in."""

CONSTANTS = {
    "exciter": {"Tr": 0.02, "Kbc": 0.0},
    "governor": {"Pmin": 0.0, "OmRef": 1.0},
    "pss": {"Kp": 0.0, "Kv": 0.0},
}
"""What DPsim's models ask for beside them."""


def _parameters(own: dict[str, dict[str, str]]) -> dict[str, Any]:
    """Return the parameters of a unit's devices by DPsim's symbols; None where it lacks one."""
    found: dict[str, Any] = {"va": float(own["machine"]["base_MVA"]) * 1e6}
    for table, symbols in SYMBOLS.items():
        row = own.get(table)
        values = row and {symbol: float(row[column]) for symbol, column in symbols.items()}
        found[table] = values and values | CONSTANTS.get(table, {})
    if found["governor"] is not None:
        found["governor"]["R"] = 1.0 / float(own["governor"]["K_pu"])
    return found
