"""How every figure of the house looks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.image import imsave

from tieline.figures.both import Both, BothCanvas
from tieline.figures.panels import Panel, PanelFigure
from tieline.figures.scales import POINTS_PER_INCH

__all__ = [
    "COLOURS",
    "PANEL_INCHES",
    "STYLE",
    "Panel",
    "PanelFigure",
    "colours",
    "save",
]

STYLE: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "savefig.dpi": 200,
    "svg.fonttype": "none",
    "svg.hashsalt": "tieline",
}
COLOURS = ("viridis", 0.12, 0.88)
"""Sequential and safe for the colour-blind; its palest tenth would be lost on white paper."""

PANEL_INCHES = (6.3, 3.2)

_COMPRESSION = 3
"""Of a PNG; the usual 6 takes one and a half times as long for files a tenth smaller."""


def colours(count: int) -> list[Any]:
    """Return `count` colours of the sequence."""
    name, first, last = COLOURS
    step = (last - first) / max(1, count - 1)
    return [mpl.colormaps[name](first + i * step) for i in range(count)]


def save(folder: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Write figures as PNG and SVG into a folder, made if missing, and return the PNG files.

    An SVG has letters as text, so that a paper's own typeface can replace them, and no date, so
    that the same figure is the same file. Both have one layout and are drawn at once.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.png" for name in figures]
    for path, figure in zip(paths, figures.values(), strict=True):
        _draw(figure, path)
    return paths


def _draw(figure: Figure, path: Path) -> None:
    dots_per_inch = mpl.rcParams["savefig.dpi"]
    figure.set_dpi(POINTS_PER_INCH)
    with path.with_suffix(".svg").open("w", encoding="utf-8") as svg:
        renderer = Both(figure, dots_per_inch, svg)
        BothCanvas(figure, renderer)
        figure.draw(renderer)
        renderer.finish()
    imsave(path, renderer.pixels(), dpi=dots_per_inch, pil_kwargs={"compress_level": _COMPRESSION})
