"""One drawing gives a PNG and an SVG that show the same."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tieline.figures import STYLE, save

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(autouse=True)
def style() -> Iterator[None]:
    """Draw all as the house does."""
    with mpl.rc_context(STYLE):
        yield


def everything() -> Figure:
    """Return a figure with all kinds of things that a renderer is asked to draw."""
    figure = Figure(figsize=(6.3, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    t = np.linspace(0.0, 10.0, 300)
    left.plot(t, np.sin(t), label="$\\omega$")
    left.fill_between(t, 0, np.sin(t), alpha=0.3)
    left.axvline(3, linestyle=":")
    left.annotate("here", (3, 0), xytext=(5, 0.5), arrowprops={"arrowstyle": "->"})
    left.legend()
    shade = right.scatter(t[::30], t[::30], c=t[::30], marker="^")
    right.imshow(np.arange(4.0).reshape(2, 2), extent=(0, 5, 0, 5), aspect="auto")
    figure.colorbar(shade, ax=right, label="gain")
    return figure


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with that figure."""
    folder = tmp_path_factory.mktemp("figures") / "plots"
    with mpl.rc_context(STYLE):
        assert save(folder, {"all": everything()}) == [folder / "all.png"]
    return folder


def test_the_png_is_what_matplotlib_draws_alone(saved: Path) -> None:
    """Otherwise drawing for two at once would show in one of them."""
    figure = everything()
    figure.set_dpi(STYLE["savefig.dpi"])
    canvas = FigureCanvasAgg(figure)
    figure.draw(canvas.get_renderer())
    alone = np.asarray(canvas.buffer_rgba()) / 255
    drawn = matplotlib.image.imread(saved / "all.png")
    # matplotlib before 3.11 leaves out what is less than a whole dot.
    assert np.abs(np.subtract(drawn.shape, alone.shape)).max() <= 1
    drawn = drawn[: len(alone)]
    # Letters are a hundredth of the picture; their places differ by less than a dot.
    assert np.mean(np.abs(drawn - alone).max(axis=2) > 0.3) < 0.01


def test_the_svg_has_the_letters_as_text_and_the_size_in_points(saved: Path) -> None:
    """Otherwise a paper's own typeface could not replace them."""
    root = ElementTree.parse(saved / "all.svg").getroot()
    words = ["".join(text.itertext()) for text in root.iter(f"{SVG}text")]
    assert {"here", "gain", "10"} <= set(words)
    assert root.get("width") == "453.6pt"
    assert root.get("height") == "331.2pt"
    assert len(list(root.iter(f"{SVG}image"))) == 1


def test_the_same_figure_is_the_same_files(saved: Path, tmp_path: Path) -> None:
    """Otherwise a result folder would change each time that it is reported."""
    save(tmp_path / "again", {"all": everything()})
    for name in ("all.png", "all.svg"):
        assert (saved / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
