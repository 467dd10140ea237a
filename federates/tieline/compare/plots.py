"""Draws recorded quantities of some runs over each other."""

import math
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tieline.compare.quantities import TABLE, TIME, Quantity
from tieline.errors import InputError
from tieline.experiment.results import Run, common_events
from tieline.figures import STYLE, colours

FORMATS = (".png", ".svg", ".pdf")
MOST_IN_LEGEND = 16

Window = tuple[float | None, float | None]
"""First and last instant drawn, s; None for the run's own."""

_LINE_LENGTH = 34
_WIDTH_INCHES = 6.3
_PANEL_INCHES = 2.4
_LINES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)))


def check_file(path: Path) -> None:
    """Refuse a picture file of another format.

    Raises:
        InputError: its suffix is none of `FORMATS`.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: a picture must end in {', '.join(FORMATS)}")


def draw(
    path: Path,
    runs: Sequence[Run],
    names: Sequence[str],
    quantities: Sequence[Quantity],
    window_s: Window = (None, None),
) -> None:
    """Draw quantities against time, one panel a kind, into a picture file.

    With one run colours tell the elements apart; with several they tell the runs apart, and the
    line's dashes the elements.

    Args:
        path: the file; its suffix says the format.
        runs: at least one.
        names: one a run.
        quantities: what is drawn.
        window_s: what part of the time.

    Raises:
        InputError: the format is unknown.
    """
    check_file(path)
    kinds = list(dict.fromkeys(quantity.kind for quantity in quantities))
    with mpl.rc_context(STYLE):
        size = (_WIDTH_INCHES, _PANEL_INCHES * len(kinds) + 0.4)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
        for axes, kind in zip(panels, kinds, strict=True):
            _panel(axes, runs, names, [one for one in quantities if one.kind == kind], window_s)
        panels[-1].set_xlabel("time, s")
        if len(runs) > 1 and len(kinds) == len(quantities):
            # Every panel would say the same.
            for axes in panels[1:]:
                axes.legend().remove()
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def _panel(
    axes: Axes,
    runs: Sequence[Run],
    names: Sequence[str],
    quantities: Sequence[Quantity],
    window_s: Window,
) -> None:
    palette = colours(len(runs) if len(runs) > 1 else len(quantities))
    for i, run in enumerate(runs):
        recorded = run.columns(TABLE)
        table = run.table(TABLE, TIME, *(one.name for one in quantities if one.name in recorded))
        table = table[table[TIME].between(*_bounds(window_s))]
        for j, quantity in enumerate(quantities):
            if quantity.name not in recorded:
                continue
            axes.plot(
                table[TIME],
                quantity.scale * table[quantity.name],
                color=palette[i if len(runs) > 1 else j],
                linestyle=_LINES[j % len(_LINES)] if len(runs) > 1 else "-",
                label=_label(names[i], quantity, len(runs), len(quantities)),
            )
    axes.set_ylabel(_axis(quantities))
    axes.margins(x=0)
    axes.ticklabel_format(useOffset=False)
    _legend(axes, len(runs) * len(quantities))
    _mark_events(axes, common_events(runs), window_s)


def _bounds(window_s: Window) -> tuple[float, float]:
    first, last = window_s
    return -math.inf if first is None else first, math.inf if last is None else last


def _label(name: str, quantity: Quantity, runs: int, quantities: int) -> str:
    if runs == 1:
        return quantity.element or quantity.name
    return name if quantities == 1 else f"{name}, {quantity.element}"


def _axis(quantities: Sequence[Quantity]) -> str:
    """Return the description and unit; of many quantities, without the element's name."""
    first = quantities[0]
    what = first.description
    if len(quantities) > 1:
        what = re.sub(r" (of|at)( bus)? \w+$", "", what)
    unit = first.unit.split(" ")[0]
    # What is long stands beside its panel in two lines.
    words = textwrap.fill(what, _LINE_LENGTH)
    return f"{words}, {unit}" if unit else words


def _legend(axes: Axes, curves: int) -> None:
    if 1 < curves <= MOST_IN_LEGEND:
        axes.legend(ncols=2 if curves > 4 else 1)
    elif curves > MOST_IN_LEGEND:
        axes.set_title(f"{curves} curves", loc="right", fontsize=8.0, color="0.35")


def _mark_events(axes: Axes, events: Sequence[tuple[float, str]], window_s: Window) -> None:
    first, last = _bounds(window_s)
    for at_s, _ in events:
        if first <= at_s <= last:
            axes.axvline(at_s, color="0.6", linewidth=0.8, linestyle=":")
