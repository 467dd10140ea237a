"""Writes the page of a sweep: all points in a table and over each other in charts."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tieline.columns import Columns
from tieline.experiment.results import POINTS, Run, common_events
from tieline.report import facts
from tieline.report.html import Html, details
from tieline.report.page import PAGE, charts, note, write_page
from tieline.report.run_page import ROUNDING
from tieline.report.store import Chart, Curve, Floats, Store, columns_of

QUANTILES = 200
"""Points of a curve of the delays reached, at most."""

Point = tuple[Run, Columns]


def write_sweep_page(
    folder: Path, manifest: Mapping[str, Any], runs: Sequence[Run], unit: str | None
) -> Path:
    """Write `report.html` of a sweep, and return its path.

    Args:
        folder: the sweep's.
        manifest: the sweep's.
        runs: its points, complete or not.
        unit: the one whose speed, voltage and belief are drawn; None for none.
    """
    complete = [run for run in runs if run.is_complete]
    store = Store()
    _put_over_time(store, complete, unit)
    _put_delays(store, complete)
    pages = [_page_of(run) for run in runs]
    data = store.data() | {
        "drawing": None,
        "areas": [],
        "events": common_events(complete),
        "focus": None,
        "begin_s": 0.0,
    }
    missing = sum(page is None and run.is_complete for run, page in zip(runs, pages, strict=True))
    said = f"{missing} points have no page: `tieline report` of a point's folder writes it."
    answer = Html(facts.comparison(runs, pages) + (note(said) if missing else ""))
    drawn = charts([chart.name for chart in store.charts])
    sections = [
        ("top", "", facts.head(manifest, None, _seeds(runs))),
        ("answer", "The answer", answer),
        ("curves", "Points against each other", Html(note(ROUNDING) + drawn)),
    ]
    if complete:
        asked = details(f"Settings of '{complete[0].label}'", facts.asked(complete[0]))
        sections.insert(1, ("asked", "What was asked", Html(facts.points(runs) + asked)))
    texts = ("manifest.json", "summary.json", "table.csv")
    named = [name for name in texts if (folder / name).is_file()]
    made = Html(facts.provenance(manifest, named) + facts.figures(folder))
    sections.append(("files", "Provenance", made))
    return write_page(folder / PAGE, str(manifest["name"]), sections, data)


def _page_of(run: Run) -> str | None:
    is_there = (run.folder / PAGE).is_file()
    return f"{POINTS}/{run.folder.name}/{PAGE}" if is_there else None


def _seeds(runs: Sequence[Run]) -> str:
    seeds = sorted({int(run.manifest["seed"]) for run in runs})
    return f"{seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else "".join(map(str, seeds))


def _put_over_time(store: Store, runs: Sequence[Run], unit: str | None) -> None:
    if not runs:
        return
    points = [(run, _grid(run, unit)) for run in runs]
    _put(store, points, "coi", "System frequency", "centre of inertia, Hz", _coi)
    if unit is not None:
        _put(store, points, "speed", f"Rotor speed of {unit}", "frequency, Hz",
             lambda run, grid: _scaled(grid, f"speed_pu.{unit}", _nominal(run)))  # fmt: skip
        _put(store, points, "vt", f"Terminal voltage of {unit}", "voltage, pu",
             lambda _, grid: _scaled(grid, f"vt_pu.{unit}"))  # fmt: skip
        _put(store, points, "error", f"Error of the average that {unit} believes",
             "believed - true, mHz", lambda run, grid: _error(run, grid, unit))  # fmt: skip
        _put(store, points, "vs", f"Stabiliser output of {unit}", "output, pu",
             lambda _, grid: _scaled(grid, f"vs_pu.{unit}"))  # fmt: skip
    _put(store, points, "age", "Age of the PMU data", "age, ms", _age, "Mean of all controllers.")


def _grid(run: Run, unit: str | None) -> Columns:
    """Return the columns of a run's grid that the page compares."""
    quantities = ("speed_pu", "vt_pu", "wbar_pu", "vs_pu")
    wanted = {"t_s", "coi_pu", *(f"{quantity}.{unit}" for quantity in quantities)}
    names = [n for n in run.columns("grid") if n in wanted or n.startswith("age_s.")]
    return run.values("grid", *names)


def _put(
    store: Store,
    points: Sequence[Point],
    name: str,
    title: str,
    y: str,
    values: Callable[[Run, Columns], Floats | None],
    note: str = "",
) -> None:
    """Add one curve a run over the instants of the longest; an earlier end leaves a gap."""
    time_s = max((_times(grid) for _, grid in points), key=len)
    rows: list[Floats] = []
    curves: list[Curve] = []
    for run, grid in points:
        found = values(run, grid)
        if found is not None and not np.isnan(found).all():
            curves.append(Curve(run.label, name, len(rows), run.label))
            rows.append(np.interp(time_s, _times(grid), found, left=np.nan, right=np.nan))
    if rows:
        store.put(name, "grid", time_s, rows)
        store.charts.append(Chart(name, title, y, curves, note, from_zero=name == "age"))


def _times(grid: Columns) -> Floats:
    return grid["t_s"]


def _nominal(run: Run) -> float:
    return float(run.told()["frequency_hz"])


def _coi(run: Run, grid: Columns) -> Floats | None:
    return _scaled(grid, "coi_pu", _nominal(run))


def _error(run: Run, grid: Columns, unit: str) -> Floats | None:
    believed = _scaled(grid, f"wbar_pu.{unit}", 1e3 * _nominal(run))
    true = _scaled(grid, "coi_pu", 1e3 * _nominal(run))
    return None if believed is None or true is None else believed - true


def _age(run: Run, grid: Columns) -> Floats | None:
    names = [f"age_s.{unit}" for unit in columns_of(grid, "age_s")]
    return 1e3 * _mean(np.array([grid[name] for name in names])) if names else None


def _mean(rows: Floats) -> Floats:
    """Return the mean (m,) of those of some rows (n, m) that have a value; NaN where none has."""
    known = ~np.isnan(rows)
    sums = np.where(known, rows, 0.0).sum(axis=0)
    return np.divide(
        sums, known.sum(axis=0), out=np.full(len(sums), np.nan), where=known.any(axis=0)
    )


def _scaled(grid: Columns, column: str, factor: float = 1.0) -> Floats | None:
    return factor * grid[column] if column in grid else None


def _put_delays(store: Store, runs: Sequence[Run]) -> None:
    """Add the share of packets that arrived within a delay, over the delays of all runs."""
    reached = {run.label: _reached(run.delays, len(runs)) for run in runs}
    found = {label: curve for label, curve in reached.items() if curve is not None}
    if not found:
        return
    edges = np.unique(np.concatenate([edge for edge, _ in found.values()]))
    rows = [np.interp(edges, edge, share) for edge, share in found.values()]
    store.put("reached", "edges", edges, rows)
    curves = [Curve(label, "reached", i, label) for i, label in enumerate(found)]
    store.charts.append(
        Chart("reached", "Packets that arrived within a delay", "packets, %", curves,
              "", "combined delay, ms", "edges", "delay", True)
    )  # fmt: skip


def _reached(counts: Columns, runs: int) -> tuple[Floats, Floats] | None:
    """Return (edges in ms, % that arrived within) at a few hundred quantiles, or None."""
    if not counts:
        return None
    edges = np.append(counts["bin_low_s"][:1], counts["bin_high_s"])
    share = np.concatenate([[0.0], np.cumsum(counts["count"].astype(np.float64))])
    share *= 100 / share[-1]
    levels = np.linspace(0, 100, max(20, min(QUANTILES, 4000 // runs)))
    kept = np.unique(np.searchsorted(share, levels).clip(0, len(share) - 1))
    return 1e3 * edges[kept], share[kept]
