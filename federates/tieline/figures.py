"""How every figure of the house looks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

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


def colours(count: int) -> list[Any]:
    """Return `count` colours of the sequence."""
    name, first, last = COLOURS
    step = (last - first) / max(1, count - 1)
    return [mpl.colormaps[name](first + i * step) for i in range(count)]


def save(folder: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Write figures as PNG and SVG into a folder, made if missing, and return the PNG files.

    An SVG has letters as text, so that a paper's own typeface can replace them, and no date, so
    that the same figure is the same file. Both have the layout of the PNG.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, figure in figures.items():
        paths.append(folder / f"{name}.png")
        pixels = _laid_out(figure)
        pixels.print_png(paths[-1])
        FigureCanvasSVG(figure).print_svg(folder / f"{name}.svg", metadata={"Date": None})
    return paths


def _laid_out(figure: Figure) -> FigureCanvasAgg:
    """Return a figure's pixels to be, its layout found once and for all.

    `savefig` would find it anew for each file, and draw once for nothing.
    """
    figure.set_dpi(mpl.rcParams["savefig.dpi"])
    canvas = FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
    return canvas
