"""Draws the network's series: delay and age of the data of every controller, the busiest links."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from tieline.batches import values_of
from tieline.columns import TableFile
from tieline.errors import InputError
from tieline.figures import PANEL_INCHES, STYLE, PanelFigure, colours, save
from tieline.report.packing import thinned
from tieline.report.windowed import Floats, Windowed

PANELS = 3
LINKS = 4
DROPS = ("dropped_queue", "dropped_loss", "dropped_down")
MOST_POINTS = 1000
"""Of a line: about as many as a figure has dots across."""
WIDE = 10.0
"""Greatest by least value from which on an axis is logarithmic."""


def draw(folder: Path, plots: Path | None = None) -> list[Path]:
    """Draw the figures of one run into its folder `plots`, and return their files.

    Args:
        folder: the run's, with `controller_series.parquet` and `link_series.parquet`.
        plots: where the files go instead; made if missing.

    Raises:
        InputError: the run has no series.
    """
    controllers = Windowed(_series(folder, "controller_series"), "unit")
    links = Windowed(_series(folder, "link_series"), "from", "to")
    with mpl.rc_context(STYLE):
        figures = {
            "controller_delay": controller_delays(controllers),
            "controller_age": controller_ages(controllers),
        }
        if links.keys:
            figures["busiest_links"] = busiest_links(links)
        return save(folder / "plots" if plots is None else plots, figures)


def has_series(folder: Path) -> bool:
    """Return whether a run's folder holds the series that `draw` needs, with any packet in them."""
    paths = [folder / f"{name}.parquet" for name in ("controller_series", "link_series")]
    if not all(path.is_file() for path in paths):
        return False
    with TableFile(paths[0]) as table:
        delivered = table.parts(["delivered"])
        return any(values_of(part.column("delivered")).any() for part in delivered)


def controller_delays(series: Windowed) -> Figure:
    """Return a figure of the delays of the slowest, the middle and the fastest controller.

    The line is the mean delay of the packets of each window, the band reaches from their median to
    their 95th percentile; grey lines are the means of all controllers.

    Args:
        series: of a `controller_series.parquet`, by unit.
    """
    edges = ("delay_p50_s", "delay_p95_s")
    figure = _bands(series, "delay_mean_s", edges, "mean; band: median to 95 %")
    figure.supylabel("combined delay, ms", fontsize=9.0)
    return figure


def controller_ages(series: Windowed) -> Figure:
    """Return a figure of the age of the data of three controllers, the oldest data first.

    The line is the mean over the PMUs, the band reaches up to the PMU whose frame is the oldest;
    grey lines are the means of all controllers.

    Args:
        series: of a `controller_series.parquet`, by unit.
    """
    edges = ("age_mean_s", "age_max_s")
    figure = _bands(series, "age_mean_s", edges, "mean of the PMUs; band: up to the oldest")
    figure.supylabel("age of the PMU data, ms", fontsize=9.0)
    return figure


def busiest_links(series: Windowed, count: int = LINKS) -> Figure:
    """Return a figure with load, queue and drops of the links that dropped most, or carried most.

    Args:
        series: of a `link_series.parquet` with at least one row, by direction.
        count: directions of links to draw.
    """
    # A window without a row is one in which the link carried nothing.
    drops = sum((series.totals(column) for column in DROPS), np.zeros(()))
    shown = np.lexsort([-series.totals("utilisation"), -drops])[:count].tolist()

    def read(column: str) -> Floats:
        return series.matrix(column, 0.0, only=shown)

    so_far = np.cumsum(sum((read(column) for column in DROPS), np.zeros(())), axis=1)
    quantities = (100 * read("utilisation"), read("max_queue"), so_far)
    figure = PanelFigure((PANEL_INCHES[0], 6.6), 3, sharex=True)
    panels = figure.axes
    styles = ("default", "steps-pre", "default")
    for axes, quantity, style in zip(panels, quantities, styles, strict=True):
        at_s, rows = thinned(series.windows, quantity, MOST_POINTS)
        for i, row, colour in zip(shown, rows, colours(len(shown)), strict=True):
            label = " to ".join(series.keys[i])
            axes.plot(at_s, row, color=colour, label=label, drawstyle=style)
    names = ("utilisation, %", "longest queue, packets", "packets dropped so far")
    for axes, name, letter in zip(panels, names, "abc", strict=True):
        axes.set_ylabel(name)
        axes.set_title(f"({letter})")
        axes.margins(x=0)
        axes.set_ylim(bottom=0)
    panels[0].set_ylim(0, 105)
    panels[2].set_xlabel("time, s")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="lower center", ncols=2)
    return figure


def _bands(series: Windowed, line: str, edges: tuple[str, str], legend: str) -> Figure:
    """Return one panel each for the controllers with the highest, middle and lowest mean."""
    lines_ms, low_ms, high_ms = (1e3 * series.matrix(name) for name in (line, *edges))
    known = np.flatnonzero(~np.isnan(lines_ms).all(axis=1))
    ranks = known[np.argsort(-np.nanmean(lines_ms[known], axis=1), kind="stable")]
    places = np.linspace(0, len(ranks) - 1, min(PANELS, len(ranks))).round().astype(int)
    figure = PanelFigure(PANEL_INCHES, columns=max(1, len(places)), sharey=True)
    at_s, lines_ms = thinned(series.windows, lines_ms[ranks], MOST_POINTS)
    low_ms, high_ms = (
        thinned(series.windows, edge[ranks], MOST_POINTS)[1] for edge in (low_ms, high_ms)
    )
    is_wide = len(ranks) and np.nanmax([lines_ms, high_ms]) > WIDE * np.nanmin(lines_ms)
    everyone = _end_to_end(at_s, lines_ms)
    for axes, i, colour in zip(figure.axes, places, colours(len(places)), strict=False):
        axes.plot(*everyone, color="0.8", linewidth=0.4)
        axes.fill_between(
            at_s, low_ms[i], high_ms[i], color=colour, alpha=0.35, linewidth=0, zorder=3
        )
        axes.plot(at_s, lines_ms[i], color=colour, zorder=4)
        axes.set_title(series.keys[ranks[i]][0])
        axes.margins(x=0)
        if is_wide:
            axes.set_yscale("log")
    figure.supxlabel(f"time, s ({legend}; grey: all controllers)", fontsize=9.0)
    return figure


def _end_to_end(at_s: Floats, rows: Floats) -> tuple[Floats, Floats]:
    """Return instants (k,) and values (k,) of all rows, a gap between each two.

    One line with gaps is drawn in a fraction of the time of a line each.
    """
    instants = np.tile(np.append(at_s, np.nan), len(rows))
    return instants, np.append(rows, np.full((len(rows), 1), np.nan), axis=1).ravel()


def _series(folder: Path, name: str) -> Path:
    path = folder / f"{name}.parquet"
    if not path.is_file():
        raise InputError(
            f"{path} is missing: the run was made with network.series_window none, or not at all"
        )
    return path
