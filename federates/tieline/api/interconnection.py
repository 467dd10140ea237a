"""An interconnection as tables: `tieline.case("miniwecc").buses`."""

from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from tieline.grid import case as stored
from tieline.grid.device_tables import DEVICE_TABLES
from tieline.grid.powerflow import solve_power_flow
from tieline.resources import case_folder, shipped
from tieline.yaml_lines import load as load_yaml


class Case:
    """An interconnection, read and checked whole; its tables are made when they are asked for.

    Attributes:
        data: the arrays that the simulation takes, all per unit.
    """

    def __init__(self, data: stored.Case) -> None:
        self.data = data

    @property
    def name(self) -> str:
        """Return the case's name."""
        return self.data.name

    @property
    def title(self) -> str:
        """Return what it is, in a sentence."""
        return self.data.base.title

    @property
    def folder(self) -> Path:
        """Return the folder of its tables."""
        return self.data.folder

    @cached_property
    def buses(self) -> pd.DataFrame:
        """Return the buses by number: kind, area, kV, voltage, generation and load as stored."""
        buses = self.data.buses
        table = {
            "kind": buses.kind,
            "area": buses.area,
            "base_kV": buses.base_kV,
            "v_pu": buses.v,
            "theta_deg": np.rad2deg(buses.theta),
            "p_gen_pu": buses.p_gen,
            "p_load_pu": buses.p_load,
            "q_load_pu": buses.q_load,
        }
        return pd.DataFrame(table, index=pd.Index(buses.number, name="bus"))

    @cached_property
    def branches(self) -> pd.DataFrame:
        """Return the branches by name: both buses, impedance and charging on the system base."""
        branches, number = self.data.branches, self.data.buses.number
        table = {
            "from_bus": number[branches.start],
            "to_bus": number[branches.end],
            "resistance_pu": branches.impedance.real,
            "reactance_pu": branches.impedance.imag,
            "susceptance_pu": branches.susceptance,
            "tap_ratio": np.abs(branches.tap),
            "phase_shift_deg": np.angle(branches.tap, deg=True),
            "kind": branches.kind,
        }
        return pd.DataFrame(table, index=pd.Index(branches.name, name="branch"))

    @cached_property
    def units(self) -> pd.DataFrame:
        """Return the units by name: bus, area, base, and the model of each of their devices."""
        data = self.data
        table = {
            "bus": data.buses.number[data.unit_bus],
            "area": np.array(data.buses.area)[data.unit_bus],
            "base_MVA": data.unit_MVA,
        }
        for role in DEVICE_TABLES:
            devices = [data.device(role, unit) for unit in data.units]
            table[role] = np.array(["" if d is None else d.model.__name__ for d in devices])
        return pd.DataFrame(table, index=pd.Index(data.units, name="unit"))

    @cached_property
    def power_flow(self) -> pd.DataFrame:
        """Return the solved voltages by bus number: `v_pu` and `theta_deg`.

        Raises:
            NumericalError: the power flow diverges.
        """
        v = solve_power_flow(self.data).v
        table = {"v_pu": np.abs(v), "theta_deg": np.angle(v, deg=True)}
        return pd.DataFrame(table, index=pd.Index(self.data.buses.number, name="bus"))

    def __repr__(self) -> str:
        sizes = f"{len(self.data.buses.number)} buses, {len(self.data.branches.name)} branches"
        return f"Case {self.name}: {self.title} ({sizes}, {len(self.data.units)} units)"


def case(name: str | Path) -> Case:
    """Return a case by its shipped name, or from a folder of one's own.

    Raises:
        InputError: there is none, or it is malformed; every finding at once.
    """
    return Case(stored.load_case(case_folder(str(name))))


def cases() -> pd.DataFrame:
    """Return the shipped cases by name, each with its title."""
    files = sorted(shipped("cases").glob("*/case.yaml"))
    titles = [load_yaml(path).data["title"] for path in files]
    return pd.DataFrame(
        {"title": titles}, index=pd.Index([path.parent.name for path in files], name="case")
    )
