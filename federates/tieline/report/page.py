"""Puts a page together: what it says, its data, and the code that draws it, all in one file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tieline.report.html import Html, data_block, element, text

ASSETS = Path(__file__).with_name("assets")
LIBRARY = Path(__file__).with_name("vendor") / "uplot"

SCRIPTS = (
    "unpack.js", "look.js", "legend.js", "charts.js", "zoom.js", "places.js", "drawing.js",
    "replay.js", "main.js",
)  # fmt: skip
"""In the order in which they build on each other."""

PAGE = "report.html"

WITHOUT_SCRIPTS = (
    "The curves and the drawing need JavaScript; the tables do not. PNG and SVG figures"
    " are in the folder plots."
)


def write_page(
    path: Path, title: str, sections: Sequence[tuple[str, str, Html]], data: Mapping[str, Any]
) -> Path:
    """Write a page that needs no other file and no network, and return its path.

    Args:
        path: of the file; replaced whole if it is there.
        title: of the page.
        sections: of each its identifier, its heading (none, if empty) and its content.
        data: what the scripts draw, as JSON.
    """
    links = [element("a", heading, href=f"#{name}") for name, heading, _ in sections if heading]
    main = [
        element("section", element("h2", heading) if heading else "", body, id=name)
        for name, heading, body in sections
    ]
    styles = (LIBRARY / "uPlot.min.css", ASSETS / "style.css")
    # The library's licence asks to go wherever the library goes.
    licence = Html(f"<!--\n{(LIBRARY / 'LICENSE').read_text(encoding='utf-8')}-->\n")
    scripts = [LIBRARY / "uPlot.iife.min.js", *(ASSETS / name for name in SCRIPTS)]
    page = [
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n',
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n',
        '<meta name="color-scheme" content="light dark">\n',
        '<link rel="icon" href="data:,">\n',
        element("title", title),
        *(Html(f"\n<style>\n{_read(style)}</style>") for style in styles),
        "\n</head>\n<body>\n",
        element("nav", *links, aria_label="sections"),
        element("main", element("noscript", element("p", WITHOUT_SCRIPTS)), *main),
        element("div", id="tip", role="status", hidden="hidden"),
        "\n",
        data_block("data", data),
        "\n",
        licence,
        *(Html(f"<script>\n{_read(script)}</script>\n") for script in scripts),
        "</body>\n</html>\n",
    ]
    part = path.with_name(f".{path.name}.part")
    part.write_text("".join(page), encoding="utf-8")
    part.replace(path)
    return path


def placeholder(kind: str, name: str) -> Html:
    """Return the place that a script fills: a `chart`, or the `drawing`."""
    return element("div", class_=kind, id=f"{kind}-{name}", data_name=name)


def charts(names: Sequence[str]) -> Html:
    """Return places for charts, two beside each other where the page is wide enough."""
    return element("div", *(placeholder("chart", name) for name in names), class_="charts")


def note(words: object) -> Html:
    """Return a remark."""
    return element("p", text(words), class_="note")


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8").rstrip() + "\n"
