"""Prepares the network's curves of one run: delays, their distribution, links, queues and drops."""

from collections.abc import Sequence

import numpy as np

from tieline.columns import Columns
from tieline.experiment.results import Run
from tieline.report.store import Chart, Curve, Floats, Store, areas_of
from tieline.report.windowed import Windowed

DROPS = ("dropped_queue", "dropped_loss", "dropped_down")
BUSIEST = 6
MOST_BARS = 160


def put_traffic(store: Store, run: Run) -> None:
    """Add what the network's tables of a run hold to a page."""
    controllers = Windowed(run.path("controller_series"), "unit")
    links = Windowed(run.path("link_series"), "from", "to")
    # Links that carried nothing have no row: their windows are known from the controllers.
    windows = np.union1d(controllers.windows, links.windows)
    _put_controllers(store, run, controllers, windows)
    _put_distribution(store, run.delays)
    _put_links(store, links, windows)


def direction(from_: str, to: str) -> str:
    """Return what one direction of a link is called."""
    return f"{from_} to {to}"


def _put_controllers(store: Store, run: Run, series: Windowed, windows: Floats) -> None:
    if not series.keys:
        return
    unit_areas, _ = areas_of(run.map())
    units = [unit for (unit,) in series.keys]
    store.put("delay", "window", windows, 1e3 * series.matrix("delay_mean_s", windows=windows))
    curves = [Curve(u, "delay", i, unit_areas.get(u) or "units", u) for i, u in enumerate(units)]
    store.charts.append(
        Chart("delay", "Delay of the packets to each controller", "combined delay, ms", curves,
              "Mean of each window, from measurement until the controller can use it.",
              axis="window")
    )  # fmt: skip


def _put_distribution(store: Store, counts: Columns) -> None:
    if not counts:
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


def _rebinned(counts: Columns) -> tuple[Floats, Floats]:
    """Return edges (n + 1,) in ms and the share (n,) in % of at most `MOST_BARS` bins."""
    bins = len(counts["count"])
    starts = np.arange(0, bins, -(-bins // MOST_BARS))
    heights = np.add.reduceat(counts["count"].astype(np.float64), starts)
    edges = np.append(counts["bin_low_s"][starts], counts["bin_high_s"][-1])
    return 1e3 * edges, 100 * heights / heights.sum()


def _put_links(store: Store, series: Windowed, windows: Floats) -> None:
    """Add load, longest queue and drops of every direction, and charts of the busiest."""
    if not series.keys:
        return
    order = sorted(range(len(series.keys)), key=series.keys.__getitem__)
    names = [direction(*series.keys[i]) for i in order]

    def put(table: str, values: Floats) -> Floats:
        store.put(table, "window", windows, values, names)
        return values

    def read(column: str) -> Floats:
        return series.matrix(column, 0.0, windows, order)

    # One after the other: each takes as much as its windows are many.
    loads = put("load", 100 * read("utilisation")).mean(axis=1)
    queues = put("queue", read("max_queue")).max(axis=1)
    dropped = read(DROPS[0])
    for column in DROPS[1:]:
        dropped += read(column)
    drops = put("dropped_so_far", np.cumsum(dropped, axis=1, out=dropped))[:, -1]
    shown = np.lexsort([-loads, -queues, -drops])[:BUSIEST].tolist()
    said = f"The {len(shown)} directions that dropped most, or had the longest queue."
    _link_chart(store, names, shown, "load", "Load of the busiest links", "utilisation, %", said)
    waited = "Most packets that waited at once in each window."
    y = "longest queue, packets"
    _link_chart(store, names, shown, "queue", "Queues of these links", y, waited)
    if drops.any():
        _link_chart(
            store, names, [i for i in shown if drops[i]], "dropped_so_far",
            "Packets dropped on links, so far", "packets", "",
        )  # fmt: skip


def _link_chart(
    store: Store,
    names: Sequence[str],
    shown: Sequence[int],
    table: str,
    title: str,
    y: str,
    note: str,
) -> None:
    curves = [Curve(names[i], table, i, names[i], style="step") for i in shown]
    store.charts.append(Chart(table, title, y, curves, note, axis="window", from_zero=True))
