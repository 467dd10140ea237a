"""Draws a topology: nodes by what stands there, links by their rate."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.figures import STYLE, colours
from tieline.network.spec import NetworkSpec
from tieline.network.topologies.constants import NS_PER_KM, PREFIX
from tieline.network.topologies.layout import layout
from tieline.network.topologies.stations import Corridor
from tieline.network.topologies.write import as_rate

Floats = NDArray[np.float64]

SUFFIXES = (".png", ".svg", ".pdf")

MOST_NAMES = 90
"""Nodes up to which each bears its name."""

WIDTHS = (0.6, 2.2)
"""Points, of the slowest and of the fastest link."""

GREYS = ("0.62", "0.3")
"""Of the slowest link and of all others."""

NAME_SIZE, NAME_GAP = 5.5, 3.5
"""Points: of a name's letters, and from its node."""

SIDES = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)], float)
SIDES[4:] *= 0.85

_BLUE, _GREEN, _ = colours(3)
KINDS: Mapping[str, Mapping[str, Any]] = {
    "substation": {"marker": "o", "ms": 4.0, "mfc": "white", "mec": "0.45"},
    "substation with a PMU": {"marker": "o", "ms": 5.5, "mfc": _GREEN, "mec": "black"},
    "substation with a controller": {"marker": "^", "ms": 6.0, "mfc": "white", "mec": "black"},
    "substation with PMU and controller": {"marker": "^", "ms": 6.5, "mfc": _GREEN, "mec": "black"},
    "router without a bus": {"marker": "d", "ms": 4.5, "mfc": "0.6", "mec": "0.3"},
    "control centre": {"marker": "s", "ms": 7.0, "mfc": _BLUE, "mec": "black"},
}
"""How each kind of node looks, in the order of the legend; later ones are drawn on top."""


def write_picture(spec: NetworkSpec, path: Path, title: str = "") -> None:
    """Draw a network into a PNG, SVG or PDF file.

    Raises:
        InputError: the file's name says none of these, or it cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"-o {path}: must end in {', '.join(SUFFIXES)} (got '{path.suffix}')")
    try:
        with mpl.rc_context(STYLE):
            picture(spec, title).savefig(path)
    except OSError as error:
        raise InputError(f"-o {path}: cannot be written ({error.strerror})") from error


def picture(spec: NetworkSpec, title: str = "") -> Figure:
    """Return a figure of a network.

    Nodes stand at their x and y, or, if one has none, where a layout of the links' propagation
    puts them. A control centre is a node without buses whose name begins with `CC_`.
    """
    xy, has_places = positions(spec)
    size = _size(xy)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    widths = link_widths(spec)
    _draw_links(axes, spec, xy, widths)
    kinds = kinds_of(spec)
    _draw_nodes(axes, xy, kinds, len(spec.nodes))
    axes.set_aspect("equal")
    axes.margins(0.06)
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks([])
    axes.set_yticks([])
    heading = title + ("" if has_places else " (no coordinates: layout of the delays)")
    figure.suptitle(heading, x=0.01, ha="left", fontsize=9.0)
    _legend(figure, kinds, widths)
    if len(spec.nodes) <= MOST_NAMES:
        _name(figure, axes, spec, xy)
    return figure


def positions(spec: NetworkSpec) -> tuple[Floats, bool]:
    """Return (n, 2) where the nodes are drawn, and whether the file says so."""
    given = [(node.x, node.y) for node in spec.nodes]
    known = [(x, y) for x, y in given if x is not None and y is not None]
    if len(known) == len(given):
        return np.array(known, np.float64).reshape(-1, 2), True
    # A link without propagation has a length all the same.
    near = [Corridor(x.a, x.b, 1.0 + x.propagation_ns / NS_PER_KM) for x in spec.links]
    return layout([node.name for node in spec.nodes], near), False


def kinds_of(spec: NetworkSpec) -> list[str]:
    """Return what each node is, as the legend calls it."""
    pmus = {source.node for source in spec.sources}
    controllers = {destination.node for destination in spec.destinations}
    kinds = []
    for node in spec.nodes:
        if not node.buses:
            is_centre = node.name.startswith(PREFIX)
            kinds.append("control centre" if is_centre else "router without a bus")
        elif node.name in controllers:
            has_pmu = node.name in pmus
            kinds.append(f"substation with {'PMU and' if has_pmu else 'a'} controller")
        else:
            kinds.append("substation with a PMU" if node.name in pmus else "substation")
    return kinds


def link_widths(spec: NetworkSpec) -> dict[int, float]:
    """Return the width of a link of each rate: equal steps from the slowest to the fastest."""
    rates = sorted({link.rate_bps for link in spec.links})
    if len(rates) < 2:
        return dict.fromkeys(rates, 1.0)
    logs = np.log(rates)
    low, high = WIDTHS
    scaled = low + (high - low) * (logs - logs[0]) / (logs[-1] - logs[0])
    return dict(zip(rates, scaled.tolist(), strict=True))


def _size(xy: Floats) -> tuple[float, float]:
    """Return inches: a page's width, or its height for what is tall."""
    extent = np.maximum(np.ptp(xy, axis=0), 1e-9) if len(xy) else np.ones(2)
    shape = float(np.clip(extent[1] / extent[0], 0.4, 1.6))
    return (6.3, 6.3 * shape + 0.9) if shape <= 1.2 else (6.3, 8.4)


def _draw_links(axes: Axes, spec: NetworkSpec, xy: Floats, widths: Mapping[int, float]) -> None:
    place = {node.name: i for i, node in enumerate(spec.nodes)}
    lines = [xy[[place[link.a], place[link.b]]] for link in spec.links]
    order = np.argsort([link.rate_bps for link in spec.links], kind="stable")
    rates = [spec.links[i].rate_bps for i in order]
    thinner = float(np.clip(400 / max(1, len(lines)), 0.3, 1.0))
    axes.add_collection(
        LineCollection(
            [lines[i] for i in order],
            linewidths=[thinner * widths[rate] for rate in rates],
            colors=[_grey(rate, widths) for rate in rates],
            zorder=1,
        )
    )


def _grey(rate_bps: int, widths: Mapping[int, float]) -> str:
    return GREYS[rate_bps > min(widths)]


def _draw_nodes(axes: Axes, xy: Floats, kinds: Sequence[str], count: int) -> None:
    for order, (kind, look) in enumerate(KINDS.items()):
        members = xy[[own == kind for own in kinds]]
        axes.plot(
            members[:, 0], members[:, 1], linestyle="", mew=0.7, zorder=2 + order,
            **{**look, "ms": _marker(look, count)},
        )  # fmt: skip


def _marker(look: Mapping[str, Any], count: int) -> float:
    return float(look["ms"] * np.clip((150 / count) ** 0.5, 0.15, 1.0))


def _name(figure: Figure, axes: Axes, spec: NetworkSpec, xy: Floats) -> None:
    """Write each name on the side of its node where it covers least.

    Sides are tried in turn; names, nodes and, at a lower price, links should not be covered. All is
    measured in points on the finished page, a name as a box of its usual width.
    """
    figure.draw_without_rendering()
    at = axes.transData.transform(xy) * 72.0 / figure.dpi
    place = {node.name: i for i, node in enumerate(spec.nodes)}
    steps = np.linspace(0.0, 1.0, 25)[:, None]
    along = [at[place[x.a]] + steps * (at[place[x.b]] - at[place[x.a]]) for x in spec.links]
    ink = [(at, 6.0), *([(np.concatenate(along), 0.4)] if along else [])]
    boxes: list[Floats] = []
    for node, point in zip(spec.nodes, at, strict=True):
        box = np.array([0.58 * NAME_SIZE * len(node.name), NAME_SIZE])
        centres = [point + side * (0.5 * box + NAME_GAP) for side in SIDES]
        costs = [_covered(centre, 0.5 * box, ink, boxes) for centre in centres]
        best = centres[int(np.argmin(costs))]
        boxes.append(np.concatenate([best, 0.5 * box]))
        axes.annotate(
            node.name,
            (float(xy[place[node.name], 0]), float(xy[place[node.name], 1])),
            xytext=(float(best[0] - point[0]), float(best[1] - point[1])),
            textcoords="offset points",
            ha="center",
            va="center_baseline",
            fontsize=NAME_SIZE,
            zorder=20,
            path_effects=[withStroke(linewidth=1.2, foreground="white")],
        )


def _covered(
    centre: Floats, half: Floats, ink: Sequence[tuple[Floats, float]], boxes: Sequence[Floats]
) -> float:
    """Return the price of a box: weights of the points in it, and its overlap with other boxes."""
    price = sum(
        weight * float((np.abs(points - centre) < half + 1.0).all(axis=1).sum())
        for points, weight in ink
    )
    for box in boxes:
        overlap = half + box[2:] - np.abs(centre - box[:2])
        price += 10.0 * float((overlap > 0).all())
    return price


def _legend(figure: Figure, kinds: Sequence[str], widths: Mapping[int, float]) -> None:
    handles = [
        Line2D([], [], linestyle="", mew=0.7, label=kind, **{**look, "ms": look["ms"]})
        for kind, look in KINDS.items()
        if kind in kinds
    ]
    shown = list(widths)
    if len(shown) > 5:
        shown = [shown[i] for i in np.linspace(0, len(shown) - 1, 5).astype(int)]
    handles += [
        Line2D([], [], color=_grey(rate, widths), linewidth=widths[rate], label=as_rate(rate))
        for rate in shown
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
