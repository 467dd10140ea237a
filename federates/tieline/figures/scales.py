"""Scales of a panel, which draw all their ticks at once."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axis import Axis, Tick, XAxis, YAxis
from matplotlib.backend_bases import RendererBase
from matplotlib.text import Text
from matplotlib.ticker import Formatter, NullLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Groups = Iterator[tuple[Tick, Floats, list[str]]]

POINTS_PER_INCH = 72

_CLOSE = 1e-9
"""Of a scale's length: a tick so little beyond its end stands at it."""


class _Scale(Axis):
    """A scale with one tick, which goes from place to place; its marks are those of matplotlib.

    matplotlib has six artists for each place, and measures each of them several times over for a
    layout and at each drawing: half of the time that a figure takes. Marks stand at the bottom or
    to the left only.
    """

    __name__: str
    reach = 0.0

    def tick_boxes(self, renderer: RendererBase) -> list[Bbox]:
        """Return the boxes of the labels at the ticks; the scale's label goes beside them."""
        boxes = [
            label.get_window_extent(renderer)
            for tick, places, texts in self._groups()
            for label in self._labels(tick, places, texts)
        ]
        self.offsetText.set_text(self.get_major_formatter().get_offset())
        length = self.dots(self.get_tick_padding())
        self.reach = max([length, *(self._outwards(box) for box in boxes)])
        self._place()
        return boxes

    def thickness(self, renderer: RendererBase) -> float:
        """Return how far ticks and labels stand out of the panel, dots; after `tick_boxes`."""
        if not self.label.get_text():
            return self.reach
        box = self.label.get_window_extent(renderer)
        return self.reach + self.dots(self.labelpad) + min(box.width, box.height)

    def dots(self, points: float) -> float:
        """Return a length in dots of the figure."""
        return points * self.axes.figure.dpi / POINTS_PER_INCH

    def draw(self, renderer: RendererBase) -> None:
        """Draw lines and labels at all ticks, and the scale's own label."""
        if not self.get_visible():
            return
        renderer.open_group(self.__name__, gid=self.get_gid())
        for tick, places, texts in self._groups():
            ends = np.tile([0.0, 1.0, np.nan], len(places))
            tick.gridline.set_data(*self._xy(np.repeat(places, 3), ends))
            tick.tick1line.set_data(*self._xy(places, np.zeros(len(places))))
            for lines in (tick.gridline, tick.tick1line):
                lines.draw(renderer)
            for label in self._labels(tick, places, texts):
                label.draw(renderer)
        self._place()
        for text in (self.label, self.offsetText):
            text.draw(renderer)
        renderer.close_group(self.__name__)

    def set_tick_params(self, *args: Any, **looks: Any) -> None:
        """Note how ticks shall look; they are made when they are drawn, and some never are."""
        vars(self).update(majorTicks=[], minorTicks=[])
        super().set_tick_params(*args, **looks)
        self.reset_ticks()

    def set_clip_path(self, path: Any, transform: Any = None) -> None:
        """Clip nothing: all lines end at the panel, and no tick is made for it."""

    def _groups(self) -> Groups:
        """Yield a tick with the places (n,) to draw it at, and what stands there."""
        yield (
            self.get_major_ticks(1)[0],
            *self._shown(self.get_majorticklocs(), self.get_major_formatter()),
        )
        if not isinstance(self.get_minor_locator(), NullLocator):
            yield (
                self.get_minor_ticks(1)[0],
                *self._shown(self.get_minorticklocs(), self.get_minor_formatter()),
            )

    def _shown(self, places: Floats, formatter: Formatter) -> tuple[Floats, list[str]]:
        texts = formatter.format_ticks(list(places))
        low, high = np.sort(self.get_transform().transform(np.asarray(self.get_view_interval())))
        at, room = self.get_transform().transform(np.asarray(places)), _CLOSE * (high - low)
        shown = np.flatnonzero((at >= low - room) & (at <= high + room))
        return np.asarray(places)[shown], [texts[i] for i in shown]

    def _labels(self, tick: Tick, places: Floats, texts: list[str]) -> Iterator[Text]:
        """Yield the tick's label as it stands at each place, where it has one."""
        if tick.label1.get_visible():
            for place, text in zip(places, texts, strict=True):
                if text:
                    tick.label1.set_text(text)
                    self._move(tick.label1, place)
                    yield tick.label1

    def _xy(self, along: Floats, across: Floats) -> tuple[Floats, Floats]:
        raise NotImplementedError

    def _move(self, label: Text, place: float) -> None:
        raise NotImplementedError

    def _outwards(self, box: Bbox) -> float:
        raise NotImplementedError

    def _place(self) -> None:
        """Put the scale's label and the factor of its numbers where they belong."""
        raise NotImplementedError


class XScale(_Scale, XAxis):
    """The scale below a panel."""

    def _xy(self, along: Floats, across: Floats) -> tuple[Floats, Floats]:
        return along, across

    def _move(self, label: Text, place: float) -> None:
        label.set_x(place)

    def _outwards(self, box: Bbox) -> float:
        return float(self.axes.bbox.y0 - box.y0)

    def _place(self) -> None:
        below = self.axes.bbox.y0 - self.reach
        self.label.set_y(below - self.dots(self.labelpad))
        self.offsetText.set_y(below - self.dots(self.OFFSETTEXTPAD))


class YScale(_Scale, YAxis):
    """The scale to the left of a panel."""

    def _xy(self, along: Floats, across: Floats) -> tuple[Floats, Floats]:
        return across, along

    def _move(self, label: Text, place: float) -> None:
        label.set_y(place)

    def _outwards(self, box: Bbox) -> float:
        return float(self.axes.bbox.x0 - box.x0)

    def _place(self) -> None:
        self.label.set_x(self.axes.bbox.x0 - self.reach - self.dots(self.labelpad))
        self.offsetText.set_y(self.axes.bbox.y1 + self.dots(self.OFFSETTEXTPAD))
