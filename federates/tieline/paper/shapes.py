"""Mode shapes as arrows, coloured by area, so that one sees which areas swing against which."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.projections.polar import PolarAxes
from numpy.typing import NDArray

from tieline.linear import Modes

Complexes = NDArray[np.complex128]

COLUMNS = 3
NAMED = 5
"""Groups of arrows that a panel names at most."""

SEEN = 0.25
"""Shorter arrows are not named."""

TOGETHER = 0.35
"""Heads that lie nearer to each other share a name."""

MOST_UNITS = 8
"""Units of a system whose names have room; of a larger one the longest arrow stands for others."""


def mode_shapes(modes: Modes, places: Sequence[int]) -> Figure:
    """Return the rotor speeds of some modes, the largest of each drawn as 1.

    Args:
        modes: the modes.
        places: which of them, at least one.
    """
    case = modes.linear.system.case
    area_of = np.array(case.buses.area)[case.unit_bus]
    areas = list(dict.fromkeys(area_of.tolist()))
    colour = {area: f"C{i}" for i, area in enumerate(areas)}
    columns = 2 if len(places) == 4 else COLUMNS
    rows = -(-len(places) // columns)
    size = 2.2 * columns, 2.3 * rows + 0.4
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(
        rows, columns, squeeze=False, subplot_kw={"projection": "polar"}
    ).ravel()
    for axes, k in zip(panels, places, strict=False):
        _arrows(axes, modes.shapes[:, k], [colour[area] for area in area_of])
        _names(axes, modes.shapes[:, k], case.units)
        axes.set_title(f"{modes.frequency_hz[k]:.3f} Hz, {modes.kinds[k]}", fontsize=7)
    for axes in panels[len(places) :]:
        axes.remove()
    handles = [Line2D([], [], color=colour[area], label=_name(area)) for area in areas]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(areas), fontsize=7)
    return figure


def _arrows(axes: PolarAxes, shape: Complexes, colours: Sequence[str]) -> None:
    for unit in np.argsort(-np.abs(shape)):
        head = np.angle(shape[unit]), np.abs(shape[unit])
        arrow = {"arrowstyle": "-|>", "color": colours[unit], "shrinkA": 0, "lw": 1.0}
        axes.annotate("", head, (0.0, 0.0), arrowprops=arrow)
    axes.set_rlim(0, 1.35)
    axes.set_rticks([0.5, 1.0])
    axes.set_xticklabels([])
    axes.set_yticklabels([])


def _names(axes: PolarAxes, shape: Complexes, units: Sequence[str]) -> None:
    """Name the arrows, those with neighbouring heads together, the longest first."""
    groups: list[tuple[complex, list[str]]] = []
    for unit in np.argsort(-np.abs(shape)):
        value = complex(shape[unit])
        near = next((names for at, names in groups if abs(at - value) < TOGETHER), None)
        if near is not None:
            near.append(units[unit])
        elif abs(value) >= SEEN and len(groups) < NAMED:
            groups.append((value, [units[unit]]))
    for value, names in groups:
        named = names if len(units) <= MOST_UNITS else names[:1]
        above = 6 if value.imag >= 0 else -6
        axes.annotate(
            ", ".join(named), (np.angle(value), abs(value)), xytext=(0, above),
            textcoords="offset points", fontsize=6, ha="center", va="center",
        )  # fmt: skip


def _name(area: str) -> str:
    return f"area {area}" if area.isdigit() else area
