"""Prepares the drawing of an interconnection: its parts, and the curve that colours each."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tieline.experiment.results import Run
from tieline.report.store import Store, rows_of
from tieline.report.traffic_curves import directions


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
        "links": _links(run, found),
        "nominal_hz": float(run.told()["frequency_hz"]),
        "with_voltages": "vbus" in store.tables,
    }


def _put_voltages(store: Store, run: Run, found: Mapping[str, Any]) -> None:
    buses = [f"B{station['bus']}" for station in found["stations"]]
    names = [f"v_pu.{bus}" for bus in buses]
    if names and set(names) <= set(run.columns("grid")):
        grid = run.table("grid", "t_s", *dict.fromkeys(names))
        time_s = grid["t_s"].to_numpy(dtype=np.float64)
        store.put("vbus", "grid", time_s, rows_of(grid, "v_pu", buses))


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


def _links(run: Run, found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the links, with the row of each direction in the tables of the traffic."""
    series = run.table("link_series", "from", "to")
    rows = {pair: i for i, pair in enumerate(directions(series))} if len(series) else {}
    return [
        link
        | {
            "ways": [rows.get((link["a"], link["b"])), rows.get((link["b"], link["a"]))],
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
