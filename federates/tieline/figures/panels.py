"""A figure of panels in rows and columns, which have the room that their labels leave."""

from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from tieline.figures.scales import POINTS_PER_INCH, XScale, YScale

Floats = NDArray[np.float64]

_PAD_POINTS = 3.0
"""Around all that is drawn, and around each panel with its labels."""
_FIRST_GUESS = {"left": 0.1, "right": 0.98, "bottom": 0.1, "top": 0.95}
"""Of the figure's size: where panels stand before their labels are measured."""

_LEAST = 0.3
"""Of the figure's size: what is left to the panels, however long their labels are."""

_MOST_INTERVALS = 9
"""Between ticks; a scale has no more, however long it is."""


class Panel(Axes):
    """Axes whose scales draw all their ticks at once."""

    xaxis: XScale
    yaxis: YScale

    def _init_axis(self) -> None:
        self.xaxis, self.yaxis = XScale(self, clear=False), YScale(self, clear=False)
        for name, scale in zip(
            ("bottom", "top", "left", "right"),
            (self.xaxis, self.xaxis, self.yaxis, self.yaxis),
            strict=True,
        ):
            self.spines[name].register_axis(scale)

    def set_title(
        self,
        label: str,
        fontdict: dict[str, Any] | None = None,
        loc: Literal["left", "center", "right"] | None = None,
        pad: float | None = None,
        *,
        y: float | None = 1.0,
        **kwargs: Any,
    ) -> Text:
        """Return a title that stays where it is put, without a look at what is around it."""
        return super().set_title(label, fontdict, loc, pad, y=y, **kwargs)

    def outside(self, renderer: RendererBase) -> Floats:
        """Return what stands out to the left, below, to the right and above (4,), dots."""
        boxes = [self.bbox.frozen()]
        for scale in (self.xaxis, self.yaxis):
            boxes += scale.tick_boxes(renderer)
        boxes += [text.get_window_extent(renderer) for text in self.texts]
        around = Bbox.union(boxes)
        # A long title may reach over the next panel's: across it takes no room.
        above = max([around.y1, *(t.get_window_extent(renderer).y1 for t in self._above(renderer))])
        return np.array(
            [
                max(self.bbox.x0 - around.x0, self.yaxis.thickness(renderer)),
                max(self.bbox.y0 - around.y0, self.xaxis.thickness(renderer)),
                around.x1 - self.bbox.x1,
                above - self.bbox.y1,
            ]
        )

    def _above(self, renderer: RendererBase) -> list[Text]:
        """Return titles and the vertical scale's factor, which goes below them."""
        words = [t for t in self.get_children() if isinstance(t, Text) and t.get_text()]
        titles = [text for text in words if text not in self.texts]
        factor = self.yaxis.offsetText
        if not factor.get_text():
            return titles
        height = factor.get_window_extent(renderer).height
        for title in titles:
            title.set_y(1 + height / self.bbox.height)
        return [*titles, factor]


class PanelFigure(Figure):
    """A figure of panels, equal in size within a row and a column.

    Args:
        size_inches: width and height.
        rows, columns: of panels.
        shared: `sharex`, `sharey` as `Figure.subplots` takes them.
    """

    def __init__(
        self, size_inches: tuple[float, float], rows: int = 1, columns: int = 1, **shared: Any
    ) -> None:
        super().__init__(figsize=size_inches)
        self._rows, self._columns = rows, columns
        self.subplots_adjust(**_FIRST_GUESS)
        self.subplots(rows, columns, squeeze=False, subplot_kw={"axes_class": Panel}, **shared)

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure, its panels where their labels leave room for them."""
        # How many ticks a panel has depends on its size, and its size on their labels.
        for _ in range(2):
            sizes = self._tick_spaces()
            self._lay_out(renderer)
            if self._tick_spaces() == sizes:
                break
        super().draw(renderer)

    def _tick_spaces(self) -> list[int]:
        scales = [scale for panel in self._panels() for scale in (panel.xaxis, panel.yaxis)]
        return [min(scale.get_tick_space(), _MOST_INTERVALS) for scale in scales]

    def _lay_out(self, renderer: RendererBase) -> None:
        pad = _PAD_POINTS * self.dpi / POINTS_PER_INCH
        outside = np.zeros((self._rows, self._columns, 4))
        for panel in self._panels():
            outside[_place(panel)] = panel.outside(renderer)
        left, below, right, above = np.moveaxis(outside, 2, 0)
        first_x, first_y = self._edges(renderer, pad)
        x, width = _spread(self.bbox.width, first_x, left.max(axis=0), right.max(axis=0), pad)
        # Rows are counted from above, places from below.
        y, height = _spread(
            self.bbox.height, first_y, below.max(axis=1)[::-1], above.max(axis=1)[::-1], pad
        )
        for panel in self._panels():
            row, column = _place(panel)
            place = Bbox.from_bounds(x[column], y[-1 - row], width, height)
            panel.set_position(place.transformed(self.transFigure.inverted()))

    def _edges(self, renderer: RendererBase, pad: float) -> tuple[float, float]:
        """Put the labels of all panels at the edges; return the room left of and below the rest."""
        left = below = pad
        for text in self.texts:
            box = text.get_window_extent(renderer)
            if box.width < box.height:
                text.set_x(pad / self.bbox.width)
                left = 3 * pad + box.width
            else:
                text.set_y(pad / self.bbox.height)
                below = 3 * pad + box.height
        for legend in self.legends:
            below = 2 * pad + legend.get_window_extent(renderer).y1
        return left, below

    def _panels(self) -> list[Panel]:
        return [axes for axes in self.axes if isinstance(axes, Panel)]


def _place(panel: Panel) -> tuple[int, int]:
    spec = panel.get_subplotspec()
    assert spec is not None
    return spec.rowspan.start, spec.colspan.start


def _spread(
    whole: float, first: float, before: Floats, behind: Floats, pad: float
) -> tuple[Floats, float]:
    """Return where each panel of a row begins (n,), and how long each of them is."""
    count = len(before)
    labels = first + pad + before.sum() + behind.sum() + 2 * pad * (count - 1)
    length = max(whole - labels, _LEAST * whole) / count
    begins = first + np.cumsum(before) + np.cumsum(behind) - behind
    return begins + (length + 2 * pad) * np.arange(count), float(length)
