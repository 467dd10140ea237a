"""Prepares the drawing of an interconnection: its parts, and the curve that colours each."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tieline.experiment.results import Run
from tieline.report.packing import thinned
from tieline.report.store import Store, columns_of, rows_of
from tieline.report.traffic_curves import direction


def drawing(store: Store, run: Run) -> dict[str, Any] | None:
    """Return what the drawing of a run shows, after adding what it needs besides the charts.

    References to curves are `[table, row]`. Returns None if the run wrote no map.
    """
    found = run.map()
    if found is None:
        return None
    _put_voltages(store, run, found)
    tripped = _trips(run)
    units = [
        unit
        | {
            "age": store.curve("age", unit["name"]),
            "speed": store.curve("speed", unit["name"]),
            "tripped_s": tripped.get(unit["name"]),
        }
        for unit in found["units"]
    ]
    return {
        **found,
        "units": units,
        "stations": [
            station | {"frequency": _frequency(store, station, units)}
            for station in found["stations"]
        ],
        "links": _links(store, found),
        "nominal_hz": float(run.told()["frequency_hz"]),
        "with_voltages": "vbus" in store.tables,
    }


def _put_voltages(store: Store, run: Run, found: Mapping[str, Any]) -> None:
    buses = [f"B{station['bus']}" for station in found["stations"]]
    names = [f"v_pu.{bus}" for bus in buses]
    if names and set(names) <= set(run.columns("grid")):
        time_s = run.values("grid", "t_s")["t_s"]
        blocks = run.blocks("grid", list(dict.fromkeys(names)))
        found_rows = {
            bus: row
            for block in blocks
            for bus, row in zip(
                columns_of(block, "v_pu"),
                thinned(time_s, rows_of(block, "v_pu", columns_of(block, "v_pu")))[1],
                strict=True,
            )
        }
        instants, _ = thinned(time_s, np.zeros((0, len(time_s))))
        store.put("vbus", "grid", instants, [found_rows[bus] for bus in buses])


def _frequency(
    store: Store, station: Mapping[str, Any], units: list[dict[str, Any]]
) -> dict[str, Any] | None:
    """Return the curve of a station's frequency: its PMU's, or else that of a unit that stays."""
    for bus in station["buses"]:
        curve = store.curve("pmu", f"B{bus}")
        if curve:
            return {"curve": curve, "of": f"PMU at bus {bus}"}
    for unit in units:
        if unit["station"] == station["name"] and unit["speed"] and unit["tripped_s"] is None:
            return {"curve": unit["speed"], "of": f"rotor of {unit['name']}"}
    return None


def _links(store: Store, found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the links, with the row of each direction in the tables of the traffic."""
    rows = {name: i for i, name in enumerate(store.elements.get("load", ()))}
    return [
        link
        | {
            "ways": [
                rows.get(direction(link["a"], link["b"])),
                rows.get(direction(link["b"], link["a"])),
            ],
            "outages": [[o["t_s"], o["is_down"]] for o in found["outages"] if o["link"] == number],
        }
        for number, link in enumerate(found["links"])
    ]


def _trips(run: Run) -> dict[str, float]:
    """Return the instant at which each unit was tripped, s."""
    words = {f"{unit} trips": unit for unit in run.tripped_units()}
    found: dict[str, float] = {}
    for t_s, what in run.events():
        if what in words:
            found.setdefault(words[what], t_s)
    return found
