"""Draws a figure once, as pixels and as SVG at the same time."""

from typing import Any, TextIO

import numpy as np
from matplotlib.backend_bases import FigureCanvasBase, GraphicsContextBase, RendererBase
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.transforms import Affine2D, Transform, TransformedPath
from numpy.typing import NDArray

from tieline.figures.scales import POINTS_PER_INCH

_HAIRLINE_POINTS = 0.3
"""Edges as wide as this hide the gaps that viewers of SVG leave between cells."""


class Both(RendererBase):
    """Hands everything that is drawn to a renderer of SVG and to one of pixels.

    What asks it for sizes is told those of the pixels' letters, so that both have one layout. Its
    unit is the point, which is SVG's.

    Args:
        figure: what will be drawn, in points.
        dots_per_inch: of the pixels.
        svg: where the SVG goes; without a date, so that the same figure is the same file.
    """

    def __init__(self, figure: Figure, dots_per_inch: float, svg: TextIO) -> None:
        super().__init__()
        width, height = (POINTS_PER_INCH * side for side in figure.get_size_inches())
        self._size = width, height
        self._dots = dots_per_inch / POINTS_PER_INCH
        self._to_dots = Affine2D().scale(self._dots)
        self._vector = RendererSVG(
            width, height, svg, image_dpi=dots_per_inch, metadata={"Date": None}
        )
        self._raster = RendererAgg(
            round(self._dots * width), round(self._dots * height), dots_per_inch
        )

    def pixels(self) -> NDArray[np.uint8]:
        """Return what was drawn (height, width, 4): red, green, blue, and opacity."""
        return np.asarray(self._raster.buffer_rgba())

    def finish(self) -> None:
        """Write the end of the SVG."""
        self._vector.finalize()

    def draw_path(
        self, gc: GraphicsContextBase, path: Path, transform: Transform, rgbFace: Any = None
    ) -> None:
        """Draw a path."""
        self._vector.draw_path(gc, path, transform, rgbFace)
        self._raster.draw_path(self._in_dots(gc), path, transform + self._to_dots, rgbFace)

    def draw_markers(
        self,
        gc: GraphicsContextBase,
        marker_path: Path,
        marker_trans: Transform,
        path: Path,
        trans: Transform,
        rgbFace: Any = None,
    ) -> None:
        """Draw a marker at each vertex of a path."""
        self._vector.draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace)
        to_dots = self._to_dots
        self._raster.draw_markers(
            self._in_dots(gc), marker_path, marker_trans + to_dots, path, trans + to_dots, rgbFace
        )

    def draw_path_collection(
        self,
        gc: GraphicsContextBase,
        master_transform: Transform,
        paths: Any,
        all_transforms: Any,
        offsets: Any,
        offset_trans: Transform,
        *looks: Any,
        **more: Any,
    ) -> None:
        """Draw many paths, each at its offset, with looks that go around."""
        self._vector.draw_path_collection(
            gc, master_transform, paths, all_transforms, offsets, offset_trans, *looks, **more
        )
        self._raster.draw_path_collection(
            self._in_dots(gc),
            master_transform + self._to_dots,
            paths,
            all_transforms,
            offsets,
            offset_trans + self._to_dots,
            *looks,
            **more,
        )

    def draw_quad_mesh(
        self,
        gc: GraphicsContextBase,
        master_transform: Transform,
        meshWidth: Any,
        meshHeight: Any,
        coordinates: Any,
        offsets: Any,
        offsetTrans: Transform,
        facecolors: Any,
        antialiased: Any,
        edgecolors: Any,
    ) -> None:
        """Draw a mesh of coloured cells."""
        mesh = (meshWidth, meshHeight, coordinates, offsets)
        edged = self.new_gc()
        edged.copy_properties(gc)
        edged.set_linewidth(max(_HAIRLINE_POINTS, gc.get_linewidth()))
        looks = (facecolors, antialiased)
        self._vector.draw_quad_mesh(edged, master_transform, *mesh, offsetTrans, *looks, None)
        self._raster.draw_quad_mesh(
            self._in_dots(gc),
            master_transform + self._to_dots,
            *mesh,
            offsetTrans + self._to_dots,
            *looks,
            edgecolors,
        )

    def draw_image(
        self, gc: GraphicsContextBase, x: float, y: float, im: Any, transform: Any = None
    ) -> None:
        """Draw an image, which comes in the resolution of the pixels."""
        self._vector.draw_image(gc, x, y, im, transform)
        x, y = (round(self._dots * place) for place in (x, y))
        self._raster.draw_image(self._in_dots(gc), x, y, im)

    def draw_text(
        self,
        gc: GraphicsContextBase,
        x: float,
        y: float,
        s: str,
        prop: FontProperties,
        angle: float,
        ismath: Any = False,
        mtext: Any = None,
    ) -> None:
        """Draw a line of text."""
        self._vector.draw_text(gc, x, y, s, prop, angle, ismath, mtext)
        x, y = self._dots * x, self._dots * y
        self._raster.draw_text(self._in_dots(gc), x, y, s, prop, angle, ismath, mtext)

    def get_text_width_height_descent(
        self, s: str, prop: FontProperties, ismath: Any
    ) -> tuple[float, float, float]:
        """Return what a text takes, in points."""
        sizes = self._raster.get_text_width_height_descent(s, prop, ismath)
        width, height, descent = (size / self._dots for size in sizes)
        return width, height, descent

    def get_canvas_width_height(self) -> tuple[float, float]:
        """Return the size of the figure, in points."""
        return self._size

    def get_image_magnification(self) -> float:
        """Return how many pixels a point has."""
        return self._dots

    def flipy(self) -> bool:
        """Return that y grows downwards."""
        return True

    def open_group(self, s: str, gid: str | None = None) -> None:
        """Begin a group of the SVG."""
        self._vector.open_group(s, gid)

    def close_group(self, s: str) -> None:
        """End a group of the SVG."""
        self._vector.close_group(s)

    def _in_dots(self, gc: GraphicsContextBase) -> GraphicsContextBase:
        """Return a context for the pixels: what it clips is given in their places."""
        own = self._raster.new_gc()
        own.copy_properties(gc)
        rectangle = gc.get_clip_rectangle()
        if rectangle is not None:
            own.set_clip_rectangle(rectangle.transformed(self._to_dots))
        path, transform = gc.get_clip_path()
        if path is not None and transform is not None:
            # matplotlib's own hints have it wrong.
            own.set_clip_path(TransformedPath(path, transform + self._to_dots))  # type: ignore[arg-type]
        return own


class BothCanvas(FigureCanvasBase):
    """Lets a layout measure with the renderer that draws."""

    def __init__(self, figure: Figure, renderer: Both) -> None:
        super().__init__(figure)
        self._renderer = renderer

    def get_renderer(self) -> Both:
        """Return the renderer."""
        return self._renderer
