"""Writes small pieces of HTML; every text is escaped here and nowhere else."""

import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

Rows = Iterable[Sequence[str]]


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def text(value: object) -> Html:
    """Return a value as HTML: escaped, unless it is HTML."""
    return value if isinstance(value, Html) else Html(escape(str(value)))


def element(name: str, *content: object, **attributes: object) -> Html:
    """Return an element; `class_` is its class, other underscores become hyphens."""
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Html(f"<{name}{given}>{''.join(text(part) for part in content)}</{name}>")


def table(head: Sequence[object], rows: Rows, caption: str, numbers_from: int = 1) -> Html:
    """Return a table that scrolls sideways where the page is narrow.

    Args:
        head: of the columns.
        rows: of cells.
        caption: what the table shows, for those who hear it read.
        numbers_from: the first column that holds numbers, which stand to the right.
    """
    heads = [
        element("th", cell, scope="col", class_="n" if i >= numbers_from else None)
        for i, cell in enumerate(head)
    ]
    body = [element("tr", *_cells(row, numbers_from)) for row in rows]
    whole = element(
        "table",
        element("caption", caption),
        element("thead", element("tr", *heads)),
        element("tbody", *body),
    )
    return element("div", whole, class_="scroll", tabindex="0", role="region", aria_label=caption)


def pairs(items: Iterable[tuple[object, object]]) -> Html:
    """Return a list of names with what they stand for."""
    entries = (element("div", element("dt", a), element("dd", b)) for a, b in items)
    return element("dl", *entries, class_="pairs")


def details(summary: str, *content: object) -> Html:
    """Return content behind a line to open."""
    return element("details", element("summary", summary), *content)


def data_block(name: str, data: Mapping[str, Any]) -> Html:
    """Return data as JSON in a script element, which nothing in it can end."""
    written = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    safe = written.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    return Html(f'<script type="application/json" id="{escape(name)}">{safe}</script>')


def _cells(row: Sequence[str], numbers_from: int) -> list[Html]:
    cells = [element("th", row[0], scope="row")] if row else []
    return cells + [
        element("td", cell, class_="n" if i >= numbers_from else None)
        for i, cell in enumerate(row[1:], start=1)
    ]
