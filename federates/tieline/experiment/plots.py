"""Draws a result's figures from its folder: frequency, voltage, delays, and what was believed."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tieline.columns import Columns
from tieline.experiment.results import Run
from tieline.figures import COLOURS, PANEL_INCHES, STYLE, PanelFigure, save

T = TypeVar("T")

WITHOUT_PACKETS = "black"
MOST_BARS = 80
MOST_NAMES = 12
"""In a legend; where there are more runs, colours in between tell enough."""
MOST_HISTOGRAMS = 24
"""In one figure; more could not be looked at."""

BELIEF_WINDOW_S = (1.0, 11.0)
"""Before and after the first event, where a late average differs from the true one."""

_DELAY_KEYS = ("engine", "delay", "mean_delay")


def draw(folder: Path, runs: Sequence[Run]) -> list[Path]:
    """Draw the figures of some runs of one experiment into `folder`, and return their files.

    Args:
        folder: where the PNG files go; made if missing.
        runs: at least one complete run, in the order of the legend.
    """
    with mpl.rc_context(STYLE):
        return save(folder, _figures(runs))


def _figures(runs: Sequence[Run]) -> dict[str, Figure]:
    figures = {"frequency": _alone(frequency, runs), "voltage": _alone(voltage, runs)}
    if any(run.delays for run in runs):
        figures["delays"] = delay_histograms(runs)
    if len(runs) == 1 and believing_unit(runs[0]):
        figures["average"] = _alone(believed_average, runs)
    figures["overview"] = overview(runs)
    return figures


def frequency(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw the frequency of the centre of inertia against time, one curve a run."""
    for run, look in zip(runs, _looks(runs), strict=True):
        grid = run.values("grid", "t_s", "coi_pu")
        nominal_hz = float(run.told()["frequency_hz"])
        axes.plot(grid["t_s"], nominal_hz * grid["coi_pu"], label=run.label, **look)
    _finish(axes, runs, "system frequency (centre of inertia), Hz")
    _mark_events(axes, runs[0])


def voltage(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw the terminal voltage of one unit against time, one curve a run."""
    unit = drawn_unit(runs[0])
    for run, look in zip(runs, _looks(runs), strict=True):
        grid = run.values("grid", "t_s", f"vt_pu.{unit}")
        axes.plot(grid["t_s"], grid[f"vt_pu.{unit}"], label=run.label, **look)
    _finish(axes, runs, f"terminal voltage of {unit}, pu")


def delay_shares(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw the share of packets that arrived within a delay, one curve a run that sent any."""
    for run, look in zip(runs, _looks(runs), strict=True):
        counts = run.delays
        if counts:
            edges = np.append(counts["bin_low_s"][0], counts["bin_high_s"])
            reached = np.concatenate([[0.0], np.cumsum(counts["count"])]) / counts["count"].sum()
            axes.plot(edges, 100 * reached, label=run.label, **look)
    axes.set_xlim(left=0)
    axes.set_ylim(0, 101)
    axes.set_xlabel("combined delay, s")
    axes.set_ylabel("frames arrived within, %")


def believed_average(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw the true centre-of-inertia frequency and what one controller takes it for."""
    run = runs[0]
    nominal_hz = float(run.told()["frequency_hz"])
    unit = believing_unit(run)
    grid = run.values("grid", "t_s", "coi_pu", f"wbar_pu.{unit}")
    start_s = min((at for at, _ in run.events()), default=0.0)
    before_s, after_s = BELIEF_WINDOW_S
    inside = (grid["t_s"] >= start_s - before_s) & (grid["t_s"] <= start_s + after_s)
    time_s = grid["t_s"][inside]
    axes.plot(
        time_s, nominal_hz * grid["coi_pu"][inside], color="black", label="true (centre of inertia)"
    )
    believed = nominal_hz * grid[f"wbar_pu.{unit}"][inside]
    axes.plot(time_s, believed, color=mpl.colormaps["viridis"](0.45), label=f"believed by {unit}")
    axes.set_xlabel("time, s")
    axes.set_ylabel("average frequency, Hz")
    axes.margins(x=0)
    axes.legend()


def delay_histograms(runs: Sequence[Run]) -> Figure:
    """Return a figure with one histogram of the combined delays for each run that sent packets."""
    sent = [(run, look) for run, look in zip(runs, _looks(runs), strict=True) if run.delays]
    shown = _spread(sent, MOST_HISTOGRAMS)
    columns = min(3, math.ceil(math.sqrt(len(shown))))
    rows = -(-len(shown) // columns)
    size = (PANEL_INCHES[0] if columns == 1 else 2.6 * columns, 2.4 * rows + 0.4)
    figure = PanelFigure(size, rows, columns)
    grid = figure.axes
    for axes, (run, look) in zip(grid, shown, strict=False):
        _histogram(axes, run, look["color"])
    for axes in grid[len(shown) :]:
        axes.remove()
    which = f" ({len(shown)} of {len(sent)} runs)" if len(shown) < len(sent) else ""
    figure.supxlabel(f"combined delay, ms{which}", fontsize=9.0)
    figure.supylabel("frames, % per ms", fontsize=9.0)
    return figure


def overview(runs: Sequence[Run]) -> Figure:
    """Return frequency, voltage and delays in one figure."""
    has_delays = any(run.delays for run in runs)
    rows = 3 if has_delays else 2
    figure = PanelFigure((PANEL_INCHES[0], 6.6 if has_delays else 4.8), rows)
    panels = figure.axes
    frequency(panels[0], runs)
    voltage(panels[1], runs)
    panels[0].set_ylabel("system frequency, Hz")
    panels[1].set_ylabel(panels[1].get_ylabel().replace("terminal voltage of ", "voltage of "))
    legend = panels[1].get_legend()
    if legend is not None:
        legend.remove()
    if has_delays:
        delay_shares(panels[2], runs)
    for letter, axes in zip("abc", panels, strict=False):
        axes.set_title(f"({letter})")
    return figure


def drawn_unit(run: Run) -> str:
    """Return the unit whose voltage is drawn: the case's, or the one that moves most."""
    chosen = run.told().get("plot_unit")
    if chosen:
        return str(chosen)
    lost = {f"vt_pu.{unit}" for unit in run.tripped_units()}
    names = [n for n in run.columns("grid") if n.startswith("vt_pu.") and n not in lost]
    swings = {
        name: np.fmax.reduce(values) - np.fmin.reduce(values)
        for block in run.blocks("grid", names)
        for name, values in block.items()
        if not np.isnan(values).all()
    }
    return max(swings, key=swings.__getitem__).removeprefix("vt_pu.")


def believing_unit(run: Run) -> str | None:
    """Return the unit whose belief is drawn: the drawn one if it has a controller."""
    prefix = "wbar_pu."
    columns = run.columns("grid")
    units = [name.removeprefix(prefix) for name in columns if name.startswith(prefix)]
    preferred = drawn_unit(run)
    return preferred if preferred in units else next(iter(units), None)


def _alone(panel: Callable[[Axes, Sequence[Run]], None], runs: Sequence[Run]) -> Figure:
    figure = PanelFigure(PANEL_INCHES)
    panel(figure.axes[0], runs)
    return figure


def _finish(axes: Axes, runs: Sequence[Run], what: str) -> None:
    axes.set_xlabel("time, s")
    axes.set_ylabel(what)
    axes.margins(x=0)
    axes.ticklabel_format(useOffset=False)
    if len(runs) > 1:
        named = _spread(axes.get_legend_handles_labels()[0], MOST_NAMES)
        axes.legend(handles=named, title=_legend_title(runs), title_fontsize=8.0, ncols=2)


def _spread(items: Sequence[T], most: int) -> Sequence[T]:
    """Return the first and the last and what is evenly between, `most` in all; all if fewer."""
    if len(items) <= most:
        return items
    return [items[round(i * (len(items) - 1) / (most - 1))] for i in range(most)]


def _mark_events(axes: Axes, run: Run) -> None:
    for at_s, text in run.events():
        axes.axvline(at_s, color="0.6", linewidth=0.8, linestyle=":")
        axes.annotate(
            text,
            (at_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(3, -2),
            textcoords="offset points",
            va="top",
            fontsize=8.0,
            color="0.35",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        )


def _looks(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Return colour and line of each run: a sequence, and black for those without packets.

    Where no run has packets, all take part in the sequence.
    """
    name, first, last = COLOURS
    coloured = [bool(run.delays) for run in runs]
    if not any(coloured):
        coloured = [True] * len(runs)
    places = np.linspace(first, last, max(2, sum(coloured)))
    colours = iter(mpl.colormaps[name](places))
    ideal = {"color": WITHOUT_PACKETS, "linestyle": (0, (4, 2)), "zorder": 3}
    return [{"color": next(colours)} if is_coloured else ideal for is_coloured in coloured]


def _legend_title(runs: Sequence[Run]) -> str | None:
    """Return what the labels stand for, where the runs differ in nothing but their delay."""
    others = [
        (
            {key: value for key, value in run.config.items() if key not in ("network", "wams")},
            {key: v for key, v in run.config["network"].items() if key not in _DELAY_KEYS},
        )
        for run in runs
    ]
    return "mean combined delay" if all(other == others[0] for other in others) else None


def _histogram(axes: Axes, run: Run, colour: Any) -> None:
    heights, edges_ms = _rebinned(run.delays)
    share = 100 * heights / heights.sum() / np.diff(edges_ms)
    axes.stairs(share, edges_ms, fill=True, color=colour)
    delay = run.summary()["delay"]
    mean_ms, p95_ms = 1e3 * delay["mean_s"], 1e3 * delay["p95_s"]
    axes.axvline(mean_ms, color="0.2", linewidth=0.9)
    axes.axvline(p95_ms, color="0.2", linewidth=0.9, linestyle=":")
    axes.set_title(f"{run.label}: mean {mean_ms:.1f} ms\n95 % within {p95_ms:.1f} ms", fontsize=8.0)
    axes.margins(x=0.02)
    axes.locator_params(axis="x", nbins=5)


def _rebinned(counts: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return heights (n,) and edges in ms (n + 1,) with bins joined to at most `MOST_BARS`."""
    bins = len(counts["count"])
    starts = np.arange(0, bins, -(-bins // MOST_BARS))
    heights = np.add.reduceat(counts["count"].astype(np.float64), starts)
    edges = 1e3 * np.append(counts["bin_low_s"][starts], counts["bin_high_s"][-1])
    return heights, edges
