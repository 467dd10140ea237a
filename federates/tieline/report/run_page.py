"""Writes the page of one run."""

from pathlib import Path

from tieline.experiment.results import Run
from tieline.report import facts
from tieline.report.drawing import drawing
from tieline.report.grid_curves import put_grid
from tieline.report.html import Html, element
from tieline.report.network_tables import controllers_table, links_table
from tieline.report.page import PAGE, charts, note, placeholder, write_page
from tieline.report.store import Store, area_name
from tieline.report.traffic_curves import put_traffic

OF_THE_GRID = ("speed", "pmu", "vt", "wbar", "error", "vs", "age")
OF_THE_NETWORK = ("delay", "histogram", "reached", "load", "queue", "dropped_so_far")
ROUNDING = (
    "Drag over a chart to zoom in on time in all charts, double-click to see everything again."
    " Curves are rounded to 1/65,000 of their own range; the tables beside this page are exact."
)


def write_run_page(run: Run, sweep: str | None = None) -> Path:
    """Write `report.html` into a run's folder, and return its path.

    Args:
        run: complete, or as far as it came; without a grid the page has no curves.
        sweep: the page of the sweep that it is a point of, as seen from its folder.
    """
    with run.kept_open():
        return _written(run, sweep)


def _written(run: Run, sweep: str | None) -> Path:
    store = Store()
    drawn = None
    if run.columns("grid") and len(run.values("grid", "t_s")["t_s"]):
        put_grid(store, run)
        put_traffic(store, run)
        drawn = drawing(store, run)
    events = _events(run)
    summary = run.summary() if run.is_complete else {}
    data = store.data() | {
        "drawing": drawn,
        "areas": _areas(run),
        "events": events,
        "focus": _focus(run),
        "begin_s": summary.get("frequency", {}).get("nadir_s", 0.0),
    }
    up = element("p", element("a", "All points of this sweep", href=sweep)) if sweep else ""
    top = Html(facts.head(run.manifest, run.manifest["label"], str(run.manifest["seed"])) + up)
    sections = [("top", "", top), ("asked", "What was asked", facts.asked(run))]
    if run.is_complete:
        sections.append(("answer", "The answer", facts.answer(run, events)))
    if drawn is not None:
        sections.append(("replay", "Replay", _replay(drawn["places"], bool(drawn["links"]))))
    grid = [chart for chart in store.charts if chart.name in OF_THE_GRID]
    network = [chart for chart in store.charts if chart.name in OF_THE_NETWORK]
    if grid:
        drawn_there = charts([chart.name for chart in grid])
        sections.append(("curves", "Grid and controllers", Html(note(ROUNDING) + drawn_there)))
    tables = links_table(run.values("links")) + controllers_table(
        run.values("flows"), run.values("ages")
    )
    drawn_there = charts([chart.name for chart in network])
    sections.append(("network", "Network", Html(drawn_there + tables)))
    files = sorted(path.name for path in run.folder.glob("*.parquet"))
    texts = ("manifest.json", "run.json", "map.json", "table.csv")
    named = [name for name in texts if (run.folder / name).is_file()]
    made = Html(facts.provenance(run.manifest, [*named, *files]) + facts.figures(run.folder))
    sections.append(("files", "Provenance", made))
    return write_page(run.folder / PAGE, f"{run.manifest['name']}: {run.label}", sections, data)


def _events(run: Run) -> list[tuple[float, str]]:
    """Return what happened to the grid, and which links went down and up, in order of time."""
    interconnection = run.map() or {"outages": (), "links": ()}
    changes = []
    for outage in interconnection["outages"]:
        link = interconnection["links"][outage["link"]]
        how = "down" if outage["is_down"] else "up"
        changes.append((float(outage["t_s"]), f"{link['a']}-{link['b']} {how}"))
    return sorted([*run.events(), *changes])


def _areas(run: Run) -> list[str]:
    interconnection = run.map()
    return [] if interconnection is None else [area_name(a) for a in interconnection["areas"]]


def _focus(run: Run) -> str | None:
    """Return the unit that stands out at first: the one that the case would have drawn."""
    chosen = run.told().get("plot_unit")
    return str(chosen) if chosen and chosen not in run.tripped_units() else None


def _replay(places: str, has_links: bool) -> Html:
    links = " Beside them, each link has a line in either direction, keeping right."
    said = (
        f"Thin lines are transmission corridors.{links if has_links else ''}"
        " A station's colour is its frequency (PMU, or else a rotor there); a square is a unit"
        f" with the age of its controller's data. Places: {places}; moved apart where they were"
        " too near, and no geography."
    )
    return Html(placeholder("drawing", "run") + note(said))
