"""A case: the tables of one interconnection, read from its folder and checked whole."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.grid.case_file import CaseFile, check_case_file, read_case_file
from tieline.grid.device_tables import (
    DEVICE_TABLES,
    Device,
    check_controls,
    parse_devices,
    read_device_table,
)
from tieline.grid.settings import STEEPEST_LOAD
from tieline.grid.tables import Findings, Row, Table, read_table

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

KINDS = ("slack", "pv", "pq")

_BUS_NUMBERS = (
    "base_kV", "v_pu", "theta_deg", "p_gen_pu", "p_load_pu", "q_load_pu",
    "g_shunt_pu", "b_shunt_pu", "q_gen_max_pu", "q_gen_min_pu",
)  # fmt: skip
_BRANCH_NUMBERS = (
    "resistance_pu", "reactance_pu", "susceptance_pu", "tap_ratio", "phase_shift_deg",
)  # fmt: skip
_LOAD_SHARES = ("p_constant_power", "p_constant_current", "q_constant_power", "q_constant_current")
_LOAD_SLOPES = ("p_frequency", "q_frequency")
_NO_BUS = -1


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
    """Arrays (n,): bus index and the parts of its load that are not constant impedance.

    `p_frequency` and `q_frequency` are the relative change of the power for a change of frequency,
    both in pu. `is_hvdc` marks the terminals of HVDC lines, which are no load.
    """

    bus: Integers
    p_constant_power: Floats
    p_constant_current: Floats
    q_constant_power: Floats
    q_constant_current: Floats
    p_frequency: Floats
    q_frequency: Floats
    is_hvdc: NDArray[np.bool_]


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
    file = read_case_file(folder, findings)
    tables = _read_tables(folder, findings)
    machines = tables["machine"]
    buses, places = _buses(tables["bus"], file.content.areas if file else None, findings)
    branches = _branches(tables["branch"], places, findings)
    loads = _loads(tables["load"], buses, places, findings)
    units, unit_bus, unit_MVA = _units(machines, places, findings)
    known_units = list(units) if machines.is_whole and units else None
    devices = {
        role: parse_devices(tables[role], role, known_units, findings)
        for role in tables
        if role in DEVICE_TABLES
    }
    _check_generation(tables["bus"], buses, unit_bus, machines, findings)
    check_controls(devices, findings)
    _check_excited(tables["pss"], tables["exciter"], findings)
    if file is not None:
        known_buses = list(places.rows) if places.is_whole else None
        check_case_file(file, known_buses, known_units, findings)
    findings.stop()
    assert file is not None
    return Case(folder, file.content, buses, branches, loads, units, unit_bus, unit_MVA, devices)


@dataclass(frozen=True)
class _Places:
    """The row of each bus by its number; `is_whole` is False where a row of bus.csv was lost."""

    rows: Mapping[int, int]
    is_whole: bool

    def find(self, row: Row, column: str, findings: Findings) -> int:
        """Return the bus's row, or `_NO_BUS` and a finding."""
        number = findings.whole(row, column)
        if number is not None and self.is_whole:
            findings.known(row.where, "bus", number, list(self.rows))
        return _NO_BUS if number is None else self.rows.get(number, _NO_BUS)


def _read_tables(folder: Path, findings: Findings) -> dict[str, Table]:
    def read(
        name: str, required: Sequence[str], optional: Sequence[str] = (), must_exist: bool = True
    ) -> Table:
        return read_table(folder / name, required, optional, findings, must_exist=must_exist)

    ends = ("from_bus", "to_bus", "circuit", "kind")
    return {
        "bus": read("bus.csv", ("bus", "kind", "area", *_BUS_NUMBERS), ("area_origin",)),
        "branch": read("branch.csv", (*ends, *_BRANCH_NUMBERS)),
        "load": read(
            "load.csv", ("bus", *_LOAD_SHARES), (*_LOAD_SLOPES, "kind", "note"), must_exist=False
        ),
        **{role: read_device_table(folder, role, findings) for role in DEVICE_TABLES},
    }


def _column(rows: Sequence[Row], name: str, findings: Findings) -> Floats:
    return np.array([findings.number(row, name) for row in rows], np.float64)


def _text(rows: Sequence[Row], name: str) -> tuple[str, ...]:
    return tuple(row.cells[name] for row in rows)


def _buses(table: Table, areas: Sequence[str] | None, findings: Findings) -> tuple[Buses, _Places]:
    rows = table.rows
    numbers = [findings.whole(row, "bus") for row in rows]
    findings.unique(rows, numbers, "bus")
    values = {name: _column(rows, name, findings) for name in _BUS_NUMBERS}
    kinds = [findings.word(row, "kind", KINDS) for row in rows]
    for at, row in enumerate(rows):
        for name in ("v_pu", "base_kV"):
            if values[name][at] <= 0:
                findings.add(row.where, f"'{name}' must be > 0 (got {row.cells[name]})")
        if values["q_gen_max_pu"][at] < values["q_gen_min_pu"][at]:
            findings.add(
                row.where,
                "'q_gen_max_pu' must be >= 'q_gen_min_pu', equal for no limits "
                f"(got {row.cells['q_gen_max_pu']} and {row.cells['q_gen_min_pu']})",
            )
        if areas is not None:
            findings.known(row.where, "area", row.cells["area"], areas)
    if table.is_whole and None not in kinds:
        _check_slack(rows, kinds, findings)
    buses = Buses(
        number=np.array([number or 0 for number in numbers], np.int64),
        base_kV=values["base_kV"],
        kind=tuple(kind or "pq" for kind in kinds),
        v=values["v_pu"],
        theta=np.deg2rad(values["theta_deg"]),
        p_gen=values["p_gen_pu"],
        p_load=values["p_load_pu"],
        q_load=values["q_load_pu"],
        g_shunt=values["g_shunt_pu"],
        b_shunt=values["b_shunt_pu"],
        q_gen_max=values["q_gen_max_pu"],
        q_gen_min=values["q_gen_min_pu"],
        area=_text(rows, "area"),
    )
    places = {number: at for at, number in enumerate(numbers) if number is not None}
    return buses, _Places(places, table.is_whole and None not in numbers)


def _check_slack(rows: Sequence[Row], kinds: Sequence[str | None], findings: Findings) -> None:
    slack = [row for row, kind in zip(rows, kinds, strict=True) if kind == "slack"]
    if not slack:
        findings.add("bus.csv:1", "needs one bus of kind slack (has none)")
    for row in slack[1:]:
        findings.add(
            row.where, f"bus {row.cells['bus']} is a second slack bus, after {slack[0].where}"
        )


def _branch_names(rows: Sequence[Row], findings: Findings) -> tuple[str, ...]:
    names, keys = [], []
    for row in rows:
        start, end = row.cells["from_bus"], row.cells["to_bus"]
        circuit = findings.whole(row, "circuit")
        names.append(branch_name(start, end, circuit or 1))
        keys.append(branch_name(min(start, end), max(start, end), circuit) if circuit else None)
        if start == end:
            findings.add(row.where, f"from_bus and to_bus must differ (got {start} twice)")
    findings.unique(rows, keys, "branch")
    return tuple(names)


def _branches(table: Table, places: _Places, findings: Findings) -> Branches:
    rows = table.rows
    names = _branch_names(rows, findings)
    start, end = (
        np.array([places.find(row, column, findings) for row in rows], np.int64)
        for column in ("from_bus", "to_bus")
    )
    values = {name: _column(rows, name, findings) for name in _BRANCH_NUMBERS}
    impedance = values["resistance_pu"] + 1j * values["reactance_pu"]
    for row, z, tap in zip(rows, impedance, values["tap_ratio"], strict=True):
        if z == 0:
            findings.add(row.where, "resistance_pu and reactance_pu must not both be 0")
        if tap <= 0:
            findings.add(
                row.where,
                f"'tap_ratio' must be > 0, 1 without a tap (got {row.cells['tap_ratio']})",
            )
    ratio = values["tap_ratio"] * np.exp(1j * np.deg2rad(values["phase_shift_deg"]))
    return Branches(
        name=names,
        start=start,
        end=end,
        impedance=impedance,
        susceptance=values["susceptance_pu"],
        tap=np.asarray(ratio, np.complex128),
        kind=_text(rows, "kind"),
    )


def branch_name(start: str, end: str, circuit: int) -> str:
    """Return a branch's name: FROM-TO, with #N for the Nth parallel circuit from the second."""
    return f"{start}-{end}" if circuit == 1 else f"{start}-{end}#{circuit}"


def _loads(table: Table, buses: Buses, places: _Places, findings: Findings) -> Loads:
    rows = table.rows
    shares = {name: _column(rows, name, findings) for name in _LOAD_SHARES}
    bus = np.array([places.find(row, "bus", findings) for row in rows], np.int64)
    findings.unique(rows, _text(rows, "bus"), "load of bus")
    for at, row in enumerate(rows):
        for letter in "pq":
            parts = [float(shares[f"{letter}_constant_{of}"][at]) for of in ("power", "current")]
            if min(parts) < 0 or sum(parts) > 1:
                findings.add(
                    row.where,
                    f"shares of {letter} must be >= 0 and sum to <= 1 "
                    f"(got {parts[0]:g} and {parts[1]:g})",
                )
        if bus[at] != _NO_BUS and buses.p_load[bus[at]] == 0 == buses.q_load[bus[at]]:
            findings.add(row.where, f"bus {row.cells['bus']} has no load in bus.csv")
    is_hvdc = np.array([row.cells.get("kind", "load") == "hvdc" for row in rows], dtype=bool)
    slopes = {name: _slopes(rows, name, is_hvdc, findings) for name in _LOAD_SLOPES}
    return Loads(bus, **shares, **slopes, is_hvdc=is_hvdc)


def _slopes(
    rows: Sequence[Row], column: str, is_hvdc: NDArray[np.bool_], findings: Findings
) -> Floats:
    """Return (rows,) a load's answers to frequency, 0 without the column or in an empty cell."""
    slopes = [findings.number(row, column) if row.cells.get(column) else 0.0 for row in rows]
    for row, slope, is_converter in zip(rows, slopes, is_hvdc, strict=True):
        if abs(slope) > STEEPEST_LOAD:
            findings.add(
                row.where,
                f"'{column}' must lie between -{STEEPEST_LOAD:g} and {STEEPEST_LOAD:g} pu/pu "
                f"(got {row.cells[column]})",
            )
        if slope and is_converter:
            findings.add(row.where, f"'{column}' must be 0 for an HVDC terminal (got {slope:g})")
    return np.array(slopes, np.float64)


def _units(
    table: Table, places: _Places, findings: Findings
) -> tuple[tuple[str, ...], Integers, Floats]:
    """Return names, bus indices and ratings, MVA, of the units."""
    rows, units = table.rows, _text(table.rows, "unit")
    if table.is_whole and not rows:
        findings.add("machine.csv:1", "has no machine: a case needs one at its slack bus")
    unit_bus = np.array([places.find(row, "bus", findings) for row in rows], np.int64)
    unit_MVA = _column(rows, "base_MVA", findings)
    for row, name, rating in zip(rows, units, unit_MVA, strict=True):
        if not name:
            findings.add(row.where, "'unit' must not be empty")
        if rating <= 0:
            findings.add(row.where, f"'base_MVA' must be > 0 (got {row.cells['base_MVA']})")
    return units, unit_bus, unit_MVA


def _check_generation(
    table: Table, buses: Buses, unit_bus: Integers, machines: Table, findings: Findings
) -> None:
    """Note generation without a unit: nothing would give it once time runs."""
    if not machines.is_whole or not machines.rows or _NO_BUS in unit_bus:
        return
    for at, row in enumerate(table.rows):
        if at not in unit_bus and (buses.kind[at] != "pq" or buses.p_gen[at] != 0):
            findings.add(
                row.where,
                f"bus {row.cells['bus']} has no unit in machine.csv, so it must be of kind pq with "
                f"p_gen_pu 0 (got {buses.kind[at]} and {row.cells['p_gen_pu']})",
            )


def _check_excited(stabilisers: Table, exciters: Table, findings: Findings) -> None:
    if exciters.is_whole:
        excited = _text(exciters.rows, "unit")
        for row in stabilisers.rows:
            if row.cells["unit"] not in excited:
                findings.add(
                    row.where, f"unit '{row.cells['unit']}' has a PSS but no exciter to act on"
                )
