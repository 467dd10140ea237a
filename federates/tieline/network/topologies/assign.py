"""Puts the buses of a case into the nodes of a topology: by a table, or evenly."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from tieline.errors import InputError
from tieline.network.findings import nearest
from tieline.network.topologies.draft import Draft
from tieline.network.topologies.power_grid import PowerGrid
from tieline.network.topologies.stations import stations_of

COLUMNS = ("bus", "node")


def by_table(draft: Draft, grid: PowerGrid, path: Path) -> Draft:
    """Return the topology with each bus in the node that a CSV file (bus, node) names.

    Raises:
        InputError: the file cannot be read or lacks a column, a bus or node does not exist, a bus
            stands twice or has no node; every finding with its line.
    """
    names = [node.name for node in draft.nodes]
    buses = [str(bus.number) for bus in grid.buses]
    node_of: dict[int, str] = {}
    findings = []
    for line, row in _rows(path):
        bus, node = (str(row[column]).strip() for column in COLUMNS)
        if bus not in buses:
            findings.append(
                f"{path}:{line}: no bus {bus or '(empty)'} in case '{grid.name}'"
                f"{nearest(bus, buses)}"
            )
        elif int(bus) in node_of:
            findings.append(f"{path}:{line}: bus {bus} is assigned twice")
        if node not in names:
            findings.append(f"{path}:{line}: no node '{node}'{nearest(node, names)}")
        if bus in buses:
            node_of.setdefault(int(bus), node)
    left = [bus.number for bus in grid.buses if bus.number not in node_of]
    if left:
        shown = ", ".join(map(str, left[:10])) + " ..." * (len(left) > 10)
        findings.append(f"{path}: {len(left)} buses of case '{grid.name}' have no node: {shown}")
    if findings:
        raise InputError(findings)
    return _with_buses(draft, node_of, f"buses: those of the case {grid.name}, by {path.name}.")


def evenly(draft: Draft, grid: PowerGrid) -> Draft:
    """Return the topology with the stations of a case dealt to the nodes, in the order of both.

    A node gets as many stations as any other, or one more; with fewer stations than nodes, some
    have none. The buses of one station stay together.
    """
    stations = stations_of(grid)
    count = len(draft.nodes)
    node_of = {
        bus: draft.nodes[i * count // len(stations)].name
        for i, station in enumerate(stations)
        for bus in station.buses
    }
    text = (
        f"buses: the {len(stations)} stations of the case {grid.name}, spread evenly over the "
        "nodes in the order of both; no geography."
    )
    return _with_buses(draft, node_of, text)


def _with_buses(draft: Draft, node_of: Mapping[int, str], text: str) -> Draft:
    buses: dict[str, list[int]] = {}
    for bus in sorted(node_of):
        buses.setdefault(node_of[bus], []).append(bus)
    nodes = tuple(replace(node, buses=tuple(buses.get(node.name, ()))) for node in draft.nodes)
    return replace(draft, nodes=nodes, made_by=(*draft.made_by, text))


def _rows(path: Path) -> Sequence[tuple[int, Mapping[str, str | None]]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            rows = [(reader.line_num, row) for row in reader]
            given = list(reader.fieldnames or ())
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: is no CSV table ({error})") from error
    if not set(COLUMNS) <= set(given):
        shown = ", ".join(given) or "none"
        raise InputError(f"{path}:1: needs the columns {' and '.join(COLUMNS)} (got {shown})")
    return rows
