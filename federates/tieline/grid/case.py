"""A case: the tables of one interconnection, read from its folder and checked whole."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tieline import yaml_lines
from tieline.grid.models.base import Model
from tieline.grid.models.registry import models
from tieline.grid.tables import Findings, Row, near, read_rows, unique

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

KINDS = ("slack", "pv", "pq")
DEVICE_TABLES = {
    "machine": "machine.csv",
    "exciter": "exciter.csv",
    "governor": "governor.csv",
    "pss": "pss.csv",
}

_BUS_NUMBERS = (
    "base_kV", "v_pu", "theta_deg", "p_gen_pu", "p_load_pu", "q_load_pu",
    "g_shunt_pu", "b_shunt_pu", "q_gen_max_pu", "q_gen_min_pu",
)  # fmt: skip
_BRANCH_NUMBERS = (
    "resistance_pu", "reactance_pu", "susceptance_pu", "tap_ratio", "phase_shift_deg",
)  # fmt: skip
_LOAD_SHARES = ("p_constant_power", "p_constant_current", "q_constant_power", "q_constant_current")


class TieMode(BaseModel):
    """Two groups of units whose swing against each other a summary reports."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    units: tuple[str, ...] = Field(min_length=1)
    against: tuple[str, ...] = Field(min_length=1)
    band_Hz: tuple[float, float]


class CaseFile(BaseModel):
    """What case.yaml says."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    title: str
    base_MVA: float = Field(gt=0)
    frequency_Hz: Literal[50, 60]
    areas: tuple[str, ...]
    sensors: tuple[int, ...] = Field(min_length=1)
    tie_mode: TieMode | None = None
    plot_unit: str | None = None


@dataclass(frozen=True)
class Buses:
    """Arrays (n,), power on the system base, angles in radians."""

    number: Integers
    base_kV: Floats
    kind: tuple[str, ...]
    v: Floats
    theta: Floats
    p_gen: Floats
    p_load: Floats
    q_load: Floats
    g_shunt: Floats
    b_shunt: Floats
    q_gen_max: Floats
    q_gen_min: Floats
    area: tuple[str, ...]


@dataclass(frozen=True)
class Branches:
    """Arrays (n,), impedances on the system base; the tap stands at the `from` end."""

    name: tuple[str, ...]
    start: Integers
    end: Integers
    impedance: NDArray[np.complex128]
    susceptance: Floats
    tap: NDArray[np.complex128]
    kind: tuple[str, ...]


@dataclass(frozen=True)
class Loads:
    """Arrays (n,): bus index and the parts of its load that are not constant impedance."""

    bus: Integers
    p_constant_power: Floats
    p_constant_current: Floats
    q_constant_power: Floats
    q_constant_current: Floats


@dataclass(frozen=True)
class Device:
    """One unit's device: its model and its parameters by symbol, on the machine base."""

    unit: str
    model: type[Model]
    values: Mapping[str, float]
    where: str


@dataclass(frozen=True)
class Case:
    """An interconnection.

    Attributes:
        base: what case.yaml says.
        units: names of the units in table order; `unit_bus` their bus index and `unit_MVA` (n,)
            their base.
        devices: for each role, the devices in table order.
    """

    folder: Path
    base: CaseFile
    buses: Buses
    branches: Branches
    loads: Loads
    units: tuple[str, ...]
    unit_bus: Integers
    unit_MVA: Floats
    devices: Mapping[str, tuple[Device, ...]]

    @property
    def name(self) -> str:
        """Return the case's name."""
        return self.base.name

    def bus_index(self, number: int) -> int:
        """Return the row of the bus of this number."""
        return int(np.flatnonzero(self.buses.number == number)[0])

    def device(self, role: str, unit: str) -> Device | None:
        """Return a unit's device of a role, if it has one."""
        return next((device for device in self.devices[role] if device.unit == unit), None)


def load_case(folder: Path) -> Case:
    """Return the case that a folder holds.

    Raises:
        InputError: anything in its tables is missing, unknown or outside its bounds; the message
            lists every finding with file and line.
    """
    findings = Findings()
    base = _case_file(folder / "case.yaml", findings)
    buses, index = _buses(folder, findings)
    branches = _branches(folder, index, findings)
    loads = _loads(folder, index, buses, findings)
    machine_rows = _machine_rows(folder, index, findings)
    units = tuple(row.cells["unit"] for row in machine_rows)
    devices = {role: _devices(folder, role, units, findings) for role in DEVICE_TABLES}
    _check_references(base, buses, units, devices, findings)
    findings.stop()
    assert base is not None
    return Case(
        folder=folder,
        base=base,
        buses=buses,
        branches=branches,
        loads=loads,
        units=units,
        unit_bus=np.array([index[findings.whole(row, "bus")] for row in machine_rows], np.int64),
        unit_MVA=np.array([findings.number(row, "base_MVA") for row in machine_rows]),
        devices=devices,
    )


def _case_file(path: Path, findings: Findings) -> CaseFile | None:
    document = yaml_lines.load(path)
    try:
        return CaseFile.model_validate(document.data)
    except ValidationError as error:
        for item in error.errors():
            where = f"{path.name}:{document.line(item['loc'])}"
            key = ".".join(str(part) for part in item["loc"])
            hint = near(str(item["loc"][-1]), list(CaseFile.model_fields)) if item["loc"] else ""
            findings.add(where, f"'{key}': {item['msg']} (got {item['input']!r}{hint})")
    return None


def _column(rows: Sequence[Row], name: str, findings: Findings) -> Floats:
    return np.array([findings.number(row, name) for row in rows], np.float64)


def _buses(folder: Path, findings: Findings) -> tuple[Buses, dict[int, int]]:
    required = ("bus", "kind", "area", *_BUS_NUMBERS)
    rows = read_rows(folder / "bus.csv", required, ("area_origin",), findings)
    findings.stop()
    unique(rows, lambda row: row.cells["bus"], "bus", findings)
    values = {name: _column(rows, name, findings) for name in _BUS_NUMBERS}
    kinds = tuple(findings.word(row, "kind", KINDS) for row in rows)
    if kinds.count("slack") != 1:
        findings.add("bus.csv", f"needs exactly one slack bus (has {kinds.count('slack')})")
    for row, v, base in zip(rows, values["v_pu"], values["base_kV"], strict=True):
        if v <= 0 or base <= 0:
            findings.add(row.where, f"v_pu and base_kV must be > 0 (got {v:g} and {base:g})")
    numbers = [findings.whole(row, "bus") for row in rows]
    buses = Buses(
        number=np.array(numbers, np.int64),
        base_kV=values["base_kV"],
        kind=kinds,
        v=values["v_pu"],
        theta=np.deg2rad(values["theta_deg"]),
        p_gen=values["p_gen_pu"],
        p_load=values["p_load_pu"],
        q_load=values["q_load_pu"],
        g_shunt=values["g_shunt_pu"],
        b_shunt=values["b_shunt_pu"],
        q_gen_max=values["q_gen_max_pu"],
        q_gen_min=values["q_gen_min_pu"],
        area=tuple(row.cells["area"] for row in rows),
    )
    return buses, {number: position for position, number in enumerate(numbers)}


def _bus_of(row: Row, column: str, index: Mapping[int, int], findings: Findings) -> int:
    number = findings.whole(row, column)
    findings.known(row.where, "bus", number, list(index))
    return index.get(number, 0)


def _branches(folder: Path, index: Mapping[int, int], findings: Findings) -> Branches:
    required = ("from_bus", "to_bus", "circuit", "kind", *_BRANCH_NUMBERS)
    rows = read_rows(folder / "branch.csv", required, (), findings)
    findings.stop()
    names = []
    for row in rows:
        ends = f"{row.cells['from_bus']}-{row.cells['to_bus']}"
        circuit = findings.whole(row, "circuit")
        names.append(ends if circuit == 1 else f"{ends}#{circuit}")
    unique(rows, lambda row: names[rows.index(row)], "branch", findings)
    values = {name: _column(rows, name, findings) for name in _BRANCH_NUMBERS}
    impedance = values["resistance_pu"] + 1j * values["reactance_pu"]
    for row, z, tap in zip(rows, impedance, values["tap_ratio"], strict=True):
        if z == 0:
            findings.add(row.where, "resistance_pu and reactance_pu must not both be 0")
        if tap <= 0:
            findings.add(row.where, f"tap_ratio must be > 0, 1 without a tap (got {tap:g})")
    return Branches(
        name=tuple(names),
        start=np.array([_bus_of(row, "from_bus", index, findings) for row in rows], np.int64),
        end=np.array([_bus_of(row, "to_bus", index, findings) for row in rows], np.int64),
        impedance=impedance,
        susceptance=values["susceptance_pu"],
        tap=np.asarray(
            values["tap_ratio"] * np.exp(1j * np.deg2rad(values["phase_shift_deg"])), np.complex128
        ),
        kind=tuple(row.cells["kind"] for row in rows),
    )


def _loads(folder: Path, index: Mapping[int, int], buses: Buses, findings: Findings) -> Loads:
    rows = read_rows(
        folder / "load.csv", ("bus", *_LOAD_SHARES), ("kind", "note"), findings, must_exist=False
    )
    findings.stop()
    unique(rows, lambda row: row.cells["bus"], "load of bus", findings)
    shares = {name: _column(rows, name, findings) for name in _LOAD_SHARES}
    bus = np.array([_bus_of(row, "bus", index, findings) for row in rows], np.int64)
    for position, row in enumerate(rows):
        for letter in "pq":
            parts = [shares[f"{letter}_constant_{what}"][position] for what in ("power", "current")]
            if min(parts) < 0 or math.fsum(parts) > 1:
                findings.add(
                    row.where, f"shares of {letter} must be >= 0 and sum to <= 1 (got {parts})"
                )
        if buses.p_load[bus[position]] == 0 == buses.q_load[bus[position]]:
            findings.add(row.where, f"bus {row.cells['bus']} has no load in bus.csv")
    return Loads(bus, **shares)


def _machine_rows(folder: Path, index: Mapping[int, int], findings: Findings) -> list[Row]:
    rows = _device_rows(folder, "machine", findings)
    unique(rows, lambda row: row.cells["unit"], "unit", findings)
    for row in rows:
        _bus_of(row, "bus", index, findings)
        if findings.number(row, "base_MVA") <= 0:
            findings.add(row.where, f"base_MVA must be > 0 (got {row.cells['base_MVA']})")
    if not rows:
        findings.add("machine.csv", "has no machine")
    findings.stop()
    return rows


def _device_rows(folder: Path, role: str, findings: Findings) -> list[Row]:
    required = ["unit", "model"] + (["bus", "base_MVA"] if role == "machine" else [])
    optional = sorted({p.column for model in models(role).values() for p in model.parameters})
    path = folder / DEVICE_TABLES[role]
    remarks = ["technology", "kind"]
    return read_rows(path, required, optional + remarks, findings, must_exist=role == "machine")


def _devices(
    folder: Path, role: str, units: Sequence[str], findings: Findings
) -> tuple[Device, ...]:
    rows = _device_rows(folder, role, Findings() if role == "machine" else findings)
    unique(rows, lambda row: row.cells["unit"], role, findings)
    devices = []
    for row in rows:
        unit = row.cells["unit"]
        findings.known(row.where, "unit", unit, units)
        model = models(role)[findings.word(row, "model", list(models(role)))]
        devices.append(Device(unit, model, _values(row, unit, model, findings), row.where))
    return tuple(devices)


def _values(row: Row, unit: str, model: type[Model], findings: Findings) -> dict[str, float]:
    values: dict[str, float] = {}
    missing = [p.column for p in model.parameters if p.column not in row.cells]
    if missing:
        findings.add(row.where, f"{model.key} needs the columns {', '.join(missing)}")
        return values
    complete = True
    for parameter in model.parameters:
        before = len(findings.items)
        value = findings.number(row, parameter.column)
        values[parameter.symbol] = value
        if len(findings.items) == before and not parameter.allows(value):
            findings.add(row.where, describe_violation(model, unit, parameter.symbol, value))
        complete = complete and len(findings.items) == before
    if complete:
        for text in model.check(values):
            findings.add(row.where, f"{model.key} of '{unit}' {text}")
    return values


def describe_violation(model: type[Model], unit: str, symbol: str, value: float) -> str:
    """Return the sentence about a parameter outside its bounds."""
    parameter = next(item for item in model.parameters if item.symbol == symbol)
    unit_text = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{model.key}.{symbol} of '{unit}' must be {parameter.bounds}{unit_text} (got {value:g})"


def _check_references(
    base: CaseFile | None,
    buses: Buses,
    units: Sequence[str],
    devices: Mapping[str, tuple[Device, ...]],
    findings: Findings,
) -> None:
    excited = {device.unit for device in devices["exciter"]}
    for device in devices["pss"]:
        if device.unit in units and device.unit not in excited:
            findings.add(device.where, f"unit '{device.unit}' has a PSS but no exciter to act on")
    if base is None:
        return
    for sensor in base.sensors:
        findings.known("case.yaml", "bus", sensor, buses.number.tolist())
    for area in sorted(set(buses.area) - set(base.areas)):
        findings.known("bus.csv", "area", area, base.areas)
    tie = base.tie_mode
    named = [*tie.units, *tie.against] if tie else []
    for unit in [*named, *([base.plot_unit] if base.plot_unit else [])]:
        findings.known("case.yaml", "unit", unit, units)
