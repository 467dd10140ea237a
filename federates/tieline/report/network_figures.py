"""Draws the network's series: delay and age of the data of every controller, the busiest links."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.figures import PANEL_INCHES, STYLE, colours, save
from tieline.tables import read_table

PANELS = 3
LINKS = 4
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
    controllers = _series(folder, "controller_series")
    links = _series(folder, "link_series")
    with mpl.rc_context(STYLE):
        figures = {
            "controller_delay": controller_delays(controllers),
            "controller_age": controller_ages(controllers),
        }
        if len(links):
            figures["busiest_links"] = busiest_links(links)
        return save(folder / "plots" if plots is None else plots, figures)


def network_plots(folder: Path) -> list[Path]:
    """Return the files that `draw` has made in a run's folder `plots`."""
    names = ("controller_delay", "controller_age", "busiest_links")
    paths = [folder / "plots" / f"{name}.png" for name in names]
    return [path for path in paths if path.is_file()]


def has_series(folder: Path) -> bool:
    """Return whether a run's folder holds the series that `draw` needs, with any packet in them."""
    paths = [folder / f"{name}.parquet" for name in ("controller_series", "link_series")]
    return all(path.is_file() for path in paths) and bool(
        read_table(paths[0], ["delivered"])["delivered"].any()
    )


def controller_delays(series: pd.DataFrame) -> Figure:
    """Return a figure of the delays of the slowest, the middle and the fastest controller.

    The line is the mean delay of the packets of each window, the band reaches from their median to
    their 95th percentile; grey lines are the means of all controllers.

    Args:
        series: a `controller_series.parquet`.
    """
    edges = ("delay_p50_s", "delay_p95_s")
    figure = _bands(series, "delay_mean_s", edges, "mean; band: median to 95 %")
    figure.supylabel("combined delay, ms", fontsize=9.0)
    return figure


def controller_ages(series: pd.DataFrame) -> Figure:
    """Return a figure of the age of the data of three controllers, the oldest data first.

    The line is the mean over the PMUs, the band reaches up to the PMU whose frame is the oldest;
    grey lines are the means of all controllers.

    Args:
        series: a `controller_series.parquet`.
    """
    edges = ("age_mean_s", "age_max_s")
    figure = _bands(series, "age_mean_s", edges, "mean of the PMUs; band: up to the oldest")
    figure.supylabel("age of the PMU data, ms", fontsize=9.0)
    return figure


def busiest_links(series: pd.DataFrame, count: int = LINKS) -> Figure:
    """Return a figure with load, queue and drops of the links that dropped most, or carried most.

    Args:
        series: a `link_series.parquet` with at least one row.
        count: directions of links to draw.
    """
    windows = sorted(set(series["t_s"]))
    drops = [f"dropped_{how}" for how in ("queue", "loss", "down")]
    sums = series.groupby(["from", "to"])[["utilisation", *drops]].sum()
    ranks = sums.assign(dropped=sums[drops].sum(axis=1))[["dropped", "utilisation"]]
    shown = list(ranks.sort_values([*ranks.columns], ascending=False).index[:count])
    figure = Figure(figsize=(PANEL_INCHES[0], 6.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    for pair, colour in zip(shown, colours(len(shown)), strict=True):
        own = series[(series["from"] == pair[0]) & (series["to"] == pair[1])]
        # A window without a row is one in which the link carried nothing.
        numbers = own.drop(columns=["from", "to"]).set_index("t_s").reindex(windows, fill_value=0)
        dropped = np.cumsum(numbers[drops].sum(axis=1))
        label = f"{pair[0]} to {pair[1]}"
        panels[0].plot(windows, 100 * numbers["utilisation"], color=colour, label=label)
        panels[1].step(windows, numbers["max_queue"], color=colour, where="pre")
        panels[2].plot(windows, dropped, color=colour)
    names = ("utilisation, %", "longest queue, packets", "packets dropped so far")
    for axes, name, letter in zip(panels, names, "abc", strict=True):
        axes.set_ylabel(name)
        axes.set_title(f"({letter})")
        axes.margins(x=0)
        axes.set_ylim(bottom=0)
    panels[0].set_ylim(0, 105)
    panels[2].set_xlabel("time, s")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _bands(series: pd.DataFrame, line: str, edges: tuple[str, str], legend: str) -> Figure:
    """Return one panel each for the controllers with the highest, middle and lowest mean."""
    means = series.groupby("unit")[line].mean().dropna().sort_values(ascending=False)
    places = np.linspace(0, len(means) - 1, min(PANELS, len(means))).round().astype(int)
    figure = Figure(figsize=PANEL_INCHES, layout="constrained")
    panels = figure.subplots(1, max(1, len(places)), sharey=True, squeeze=False)[0]
    values = 1e3 * series[[line, edges[1]]]
    is_wide = values.max().max() > WIDE * values[line].min()
    everyone = _end_to_end(series, line)
    for axes, unit, colour in zip(panels, means.index[places], colours(len(places)), strict=False):
        axes.plot(*everyone, color="0.8", linewidth=0.4)
        own = series[series["unit"] == unit]
        low, high = (1e3 * own[edge] for edge in edges)
        axes.fill_between(own["t_s"], low, high, color=colour, alpha=0.35, linewidth=0, zorder=3)
        axes.plot(own["t_s"], 1e3 * own[line], color=colour, zorder=4)
        axes.set_title(unit)
        axes.margins(x=0)
        if is_wide:
            axes.set_yscale("log")
    figure.supxlabel(f"time, s ({legend}; grey: all controllers)", fontsize=9.0)
    return figure


def _end_to_end(series: pd.DataFrame, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return instants in s and values in ms of all controllers, a gap between each two.

    One line with gaps is drawn in a fraction of the time of a line each.
    """
    parts = [part for _, part in series.groupby("unit")]
    times = [value for part in parts for value in (*part["t_s"], np.nan)]
    values = [value for part in parts for value in (*(1e3 * part[name]), np.nan)]
    return np.array(times), np.array(values)


def _series(folder: Path, name: str) -> pd.DataFrame:
    path = folder / f"{name}.parquet"
    if not path.is_file():
        raise InputError(
            f"{path} is missing: the run was made with network.series_window none, or not at all"
        )
    return read_table(path)
