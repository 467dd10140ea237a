"""Prepares the network's curves of one run: delays, their distribution, links, queues and drops."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from tieline.experiment.results import Run
from tieline.report.store import Chart, Curve, Floats, Store, areas_of

DROPS = ("dropped_queue", "dropped_loss", "dropped_down")
BUSIEST = 6
MOST_BARS = 160


def put_traffic(store: Store, run: Run) -> None:
    """Add what the network's tables of a run hold to a page."""
    controllers = _some(run, "controller_series", ("t_s", "unit", "delay_mean_s"))
    links = _some(run, "link_series", ("t_s", "from", "to", "utilisation", "max_queue", *DROPS))
    # Links that carried nothing have no row: their windows are known from the controllers.
    windows = _windows(controllers, links)
    _put_controllers(store, run, controllers, windows)
    _put_distribution(store, run.table("delays"))
    _put_links(store, links, windows)


def _some(run: Run, name: str, columns: Sequence[str]) -> pd.DataFrame:
    """Return some columns of a table; no rows if the run wrote none."""
    return run.table(name, *columns) if run.columns(name) else pd.DataFrame()


def directions(series: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the directions of links that a `link_series` has rows of, in order."""
    pairs = series[["from", "to"]].drop_duplicates()
    return sorted(zip(pairs["from"], pairs["to"], strict=True))


def _windows(*tables: pd.DataFrame) -> Floats:
    """Return the instants (m,) of all windows that some table has a row of."""
    found = [table["t_s"].to_numpy(dtype=np.float64) for table in tables if not table.empty]
    return np.unique(np.concatenate([np.zeros(0), *found]))


def _put_controllers(store: Store, run: Run, series: pd.DataFrame, windows: Floats) -> None:
    if series.empty:
        return
    unit_areas, _ = areas_of(run.map())
    units = list(dict.fromkeys(series["unit"]))
    wide = series.pivot(index="t_s", columns="unit", values="delay_mean_s")[units]
    wide = wide.reindex(windows)
    store.put("delay", "window", windows, 1e3 * wide.to_numpy(dtype=np.float64).T)
    curves = [Curve(u, "delay", i, unit_areas.get(u) or "units", u) for i, u in enumerate(units)]
    store.charts.append(
        Chart("delay", "Delay of the packets to each controller", "combined delay, ms", curves,
              "Mean of each window, from measurement until the controller can use it.",
              axis="window")
    )  # fmt: skip


def _put_distribution(store: Store, counts: pd.DataFrame) -> None:
    if counts.empty or not counts["count"].any():
        return
    edges_ms, share = _rebinned(counts)
    middles_ms = (edges_ms[1:] + edges_ms[:-1]) / 2
    store.put("share", "bins", middles_ms, [share / np.diff(edges_ms)])
    reached = np.concatenate([[0.0], np.cumsum(share)])
    store.put("reached", "edges", edges_ms, [reached])
    bars = [Curve("share", "share", 0, "share")]
    store.charts.append(
        Chart("histogram", "Distribution of the delays", "packets, % per ms", bars,
              "Every packet that arrived.", "combined delay, ms", "bins", "bars", True)
    )  # fmt: skip
    line = [Curve("arrived", "reached", 0, "arrived")]
    store.charts.append(
        Chart("reached", "Packets that arrived within a delay", "packets, %", line,
              "", "combined delay, ms", "edges", "delay", True)
    )  # fmt: skip


def _rebinned(counts: pd.DataFrame) -> tuple[Floats, Floats]:
    """Return edges (n + 1,) in ms and the share (n,) in % of at most `MOST_BARS` bins."""
    filled = np.flatnonzero(counts["count"])
    counts = counts.iloc[filled[0] : filled[-1] + 1]
    joined = -(-len(counts) // MOST_BARS)
    starts = np.arange(0, len(counts), joined)
    heights = np.add.reduceat(counts["count"].to_numpy(dtype=np.float64), starts)
    edges = np.append(counts["bin_low_s"].to_numpy()[starts], counts["bin_high_s"].iloc[-1])
    return 1e3 * edges, 100 * heights / heights.sum()


def _put_links(store: Store, series: pd.DataFrame, windows: Floats) -> None:
    """Add load, longest queue and drops of every direction, and charts of the busiest."""
    if series.empty:
        return
    pairs = directions(series)
    # Groups are numbered in the order of their sorted keys, which is that of the pairs.
    ways = series.groupby(["from", "to"], sort=True).ngroup()
    series = series.assign(dropped=series[list(DROPS)].sum(axis=1), way=ways)
    load = 100 * _wide(series, "utilisation", windows, len(pairs))
    queue = _wide(series, "max_queue", windows, len(pairs))
    store.put("load", "window", windows, load)
    store.put("queue", "window", windows, queue)
    so_far = np.cumsum(_wide(series, "dropped", windows, len(pairs)), axis=1)
    store.put("dropped_so_far", "window", windows, so_far)
    ranks: list[Any] = [so_far[:, -1], queue.max(axis=1), load.mean(axis=1)]
    shown = np.lexsort([-rank for rank in reversed(ranks)])[:BUSIEST].tolist()
    said = f"The {len(shown)} directions that dropped most, or had the longest queue."
    _link_chart(store, pairs, shown, "load", "Load of the busiest links", "utilisation, %", said)
    waited = "Most packets that waited at once in each window."
    y = "longest queue, packets"
    _link_chart(store, pairs, shown, "queue", "Queues of these links", y, waited)
    if so_far[:, -1].any():
        _link_chart(
            store, pairs, [i for i in shown if so_far[i, -1]], "dropped_so_far",
            "Packets dropped on links, so far", "packets", "",
        )  # fmt: skip


def _link_chart(
    store: Store,
    pairs: Sequence[tuple[str, str]],
    shown: Sequence[int],
    table: str,
    title: str,
    y: str,
    note: str,
) -> None:
    labels = {i: " to ".join(pairs[i]) for i in shown}
    curves = [Curve(labels[i], table, i, labels[i], style="step") for i in shown]
    store.charts.append(Chart(table, title, y, curves, note, axis="window", from_zero=True))


def _wide(series: pd.DataFrame, column: str, windows: Floats, count: int) -> Floats:
    """Return (directions, windows); one without a row is one in which nothing moved."""
    values = np.zeros((count, len(windows)))
    at = np.searchsorted(windows, series["t_s"].to_numpy(dtype=np.float64))
    values[series["way"].to_numpy(), at] = series[column].to_numpy(dtype=np.float64)
    return values
