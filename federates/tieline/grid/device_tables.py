"""The device tables of a case: which model each unit has in each role, with checked parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tieline.grid.models.base import Machine, Model
from tieline.grid.models.registry import models
from tieline.grid.tables import Findings, Row, Table, read_table

DEVICE_TABLES = {
    "machine": "machine.csv",
    "exciter": "exciter.csv",
    "governor": "governor.csv",
    "pss": "pss.csv",
}

_REMARKS = ("technology", "kind")
_PLACE = ("unit", "model", "bus", "base_MVA")


@dataclass(frozen=True)
class Device:
    """One unit's device: its model and its parameters by symbol, on the machine base."""

    unit: str
    model: type[Model]
    values: Mapping[str, float]
    where: str


def read_device_table(folder: Path, role: str, findings: Findings) -> Table:
    """Return the table of a role; only that of the machines must be there."""
    required = _PLACE if role == "machine" else _PLACE[:2]
    columns = {p.column for model in models(role).values() for p in model.parameters}
    optional = [*sorted(columns - set(required)), *_REMARKS]
    must_exist = role == "machine"
    return read_table(
        folder / DEVICE_TABLES[role], required, optional, findings, must_exist=must_exist
    )


def parse_devices(
    table: Table, role: str, units: Sequence[str] | None, findings: Findings
) -> tuple[Device, ...]:
    """Return the devices of a table; those whose model is unknown are left out, with a finding.

    Args:
        table: as `read_device_table` returns it.
        role: its role.
        units: the units that there are; None where they could not be read whole.
        findings: takes what is wrong.
    """
    findings.unique(table.rows, [row.cells["unit"] for row in table.rows], role + " of unit")
    devices = []
    for row in table.rows:
        unit = row.cells["unit"]
        if units is not None:
            findings.known(row.where, "unit", unit, units)
        key = findings.word(row, "model", list(models(role)))
        if key is not None:
            model = models(role)[key]
            values = _values(row, unit, model, findings)
            devices.append(Device(unit, model, values, row.where))
    return tuple(devices)


def _values(row: Row, unit: str, model: type[Model], findings: Findings) -> dict[str, float]:
    own = {parameter.column for parameter in model.parameters}
    for column, text in row.cells.items():
        if text and column not in {*own, *_PLACE, *_REMARKS}:
            findings.add(row.where, f"{model.key} has no '{column}': leave it empty (got {text!r})")
    given = [p for p in model.parameters if row.cells.get(p.column) or p.default is None]
    missing = [p.column for p in given if p.column not in row.cells]
    if missing:
        findings.add(row.where, f"{model.key} needs the columns {', '.join(missing)}")
        return {}
    before = len(findings.items)
    values = {p.symbol: p.default for p in model.parameters if p.default is not None}
    values |= {p.symbol: findings.number(row, p.column) for p in given}
    if len(findings.items) == before:
        for text in violations(model, unit, values):
            findings.add(row.where, text)
    return values


def check_controls(devices: Mapping[str, Sequence[Device]], findings: Findings) -> None:
    """Note each control of a unit whose machine does not take one of its role."""
    machines = {device.unit: device.model for device in devices["machine"]}
    for role, of_role in devices.items():
        for device in of_role:
            machine = machines.get(device.unit)
            if role != "machine" and machine is not None and role not in _controls(machine):
                findings.add(
                    device.where, f"unit '{device.unit}' is a {machine.key}, which takes no {role}"
                )


def _controls(machine: type[Model]) -> frozenset[str]:
    assert issubclass(machine, Machine)
    return machine.controls


def violations(model: type[Model], unit: str, values: Mapping[str, float]) -> list[str]:
    """Return a sentence for each parameter outside its bounds, or else for what contradicts."""
    outside = [
        f"{model.key}.{p.symbol} of '{unit}' must be {p.bounds}"
        f"{'' if p.unit == '1' else ' ' + p.unit} (got {values[p.symbol]:g})"
        for p in model.parameters
        if not p.allows(values[p.symbol])
    ]
    return outside or [f"{model.key} of '{unit}' {text}" for text in model.check(values)]
