"""Panels look as matplotlib's own axes do, and nothing of them is cut off."""

from collections.abc import Iterator

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from tieline.figures import STYLE, Panel, PanelFigure

NOTICED = 40
"""Of 255: a pixel that differs by less is the edge of a letter that begins elsewhere in its dot."""


@pytest.fixture(autouse=True)
def style() -> Iterator[None]:
    """Draw all as the house does."""
    with mpl.rc_context(STYLE):
        yield


def pixels(figure: Figure) -> np.ndarray:
    """Return a drawn figure, (height, width, 4)."""
    canvas = FigureCanvasAgg(figure)
    figure.draw(canvas.get_renderer())
    return np.asarray(canvas.buffer_rgba()).astype(int)


def curve(axes: Axes, scale: str, factor: float) -> None:
    """Draw something with a scale, a title and labels."""
    t = np.linspace(0.0, 20.0, 200)
    axes.plot(t, factor * (1.02 + np.exp(-t / 5) * np.sin(t)))
    axes.set_yscale(scale)
    axes.set_xlabel("time, s")
    axes.set_ylabel("voltage, pu")
    axes.set_title("(a)", y=1.0)
    axes.margins(x=0)


@pytest.mark.parametrize(
    ("scale", "factor"), [("linear", 1.0), ("linear", 1e7), ("linear", -1e-3), ("log", 10.0)]
)
def test_a_panel_looks_as_axes_of_matplotlib_do(scale: str, factor: float) -> None:
    """Otherwise a reader would find ticks, grid or labels in places that mean something else."""
    own = PanelFigure((6.3, 3.2))
    curve(own.axes[0], scale, factor)
    drawn = pixels(own)
    plain = Figure(figsize=(6.3, 3.2))
    axes = plain.add_axes(own.axes[0].get_position())
    curve(axes, scale, factor)
    if factor == 1e7:
        # The factor of the numbers stands where the title would; each makes room in its own way.
        own.axes[0].set_title("")
        axes.set_title("")
        drawn = pixels(own)
        axes.set_position(own.axes[0].get_position())
    differs = np.abs(drawn - pixels(plain)).max(axis=2) > NOTICED
    assert np.mean(differs) < 1e-4


def layouts() -> list[PanelFigure]:
    """Return figures whose labels reach out on every side."""
    rows = PanelFigure((6.3, 6.6), 3, sharex=True)
    for axes in rows.axes:
        curve(axes, "linear", 3e7)
    rows.axes[0].annotate("ends here", (20.0, 1.0), xycoords=("data", "axes fraction"))
    rows.axes[0].lines[0].set_label("a curve")
    rows.legend(*rows.axes[0].get_legend_handles_labels(), loc="lower center")
    columns = PanelFigure((6.3, 3.2), 1, 3, sharey=True)
    for axes in columns.axes:
        curve(axes, "linear", -1e-3)
        axes.set_ylabel("")
        axes.set_xlabel("")
    columns.supxlabel("time, s")
    columns.supylabel("voltage, pu")
    alone = PanelFigure((6.3, 3.2))
    curve(alone.axes[0], "log", 1e5)
    return [rows, columns, alone]


class Seen(RendererAgg):
    """Remembers the texts that were drawn, and their boxes."""

    def __init__(self, figure: Figure) -> None:
        super().__init__(figure.bbox.width, figure.bbox.height, figure.dpi)
        self.boxes: dict[tuple[str, float, float], Bbox] = {}

    def draw_text(self, gc, x, y, s, prop, angle, ismath=False, mtext=None) -> None:
        """Draw a line of text."""
        self.boxes[s, x, y] = mtext.get_window_extent(self)
        super().draw_text(gc, x, y, s, prop, angle, ismath, mtext)


@pytest.mark.parametrize("number", range(3))
def test_nothing_is_cut_off_and_no_panel_covers_another(number: int) -> None:
    """Otherwise a label would be lost, or stand in another panel."""
    figure = layouts()[number]
    seen = Seen(figure)
    figure.draw(seen)
    assert len(seen.boxes) > 10
    for text, box in seen.boxes.items():
        assert box.x0 >= 0, text
        assert box.y0 >= 0, text
        assert box.x1 <= figure.bbox.width, text
        assert box.y1 <= figure.bbox.height, text
    outer = [around(panel, seen) for panel in figure.axes]
    for i, one in enumerate(outer):
        assert not any(one.overlaps(other) for other in outer[i + 1 :])


def around(panel: Panel, renderer: Seen) -> Bbox:
    """Return the box of a panel with all that belongs to it."""
    left, below, right, above = panel.outside(renderer)
    box = panel.bbox
    return Bbox.from_extents(box.x0 - left, box.y0 - below, box.x1 + right, box.y1 + above)


def test_a_factor_of_the_numbers_is_not_under_the_title() -> None:
    """Otherwise '1e7' and '(a)' could not be read, and values would seem ten million times less."""
    figure = PanelFigure((6.3, 3.2))
    curve(figure.axes[0], "linear", 1e7)
    canvas = FigureCanvasAgg(figure)
    figure.draw(canvas.get_renderer())
    panel = figure.axes[0]
    factor = panel.yaxis.get_offset_text()
    (title,) = [t for t in panel.get_children() if isinstance(t, Text) and t.get_text() == "(a)"]
    assert factor.get_text() == "1e7"
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in (factor, title)]
    assert not boxes[0].overlaps(boxes[1])


def test_long_words_leave_room_for_what_is_drawn() -> None:
    """Otherwise the points of a sweep over many settings, whose names are long, had no picture."""
    figure = PanelFigure((7.8, 2.8), 1, 3)
    for axes in figure.axes:
        curve(axes, "linear", 1.0)
        axes.set_title("mean_delay=0.25 s, jitter.high=3.2 ms, loss=1.4 %, cross_traffic=0.8")
    pixels(figure)
    assert min(axes.bbox.width for axes in figure.axes) > 0.2 * figure.bbox.width
    figure.axes[0].annotate("w" * 200, (20.0, 1.0), xycoords=("data", "axes fraction"))
    pixels(figure)
    assert min(axes.bbox.width for axes in figure.axes) > 0.09 * figure.bbox.width
