"""The tables that `tieline compare` shows, and the same as plain data."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tieline.compare.differences import Figure, Row

LONGEST_VALUE = 28
NONE = "-"


def show(
    console: Console,
    names: Sequence[str],
    rows: Sequence[Row],
    settings: Mapping[str, Sequence[Any]],
) -> None:
    """Print figures with their differences from the first run, then the settings that differ."""
    for block in _blocks(console.width, names, [_cells(row) for row in rows], ""):
        console.print(block)
    if not settings:
        _say(console, "no setting differs")
        return
    lines = [(key, [_short(value) for value in values]) for key, values in settings.items()]
    for block in _blocks(console.width, names, lines, "setting"):
        console.print(block)


def as_data(
    names: Sequence[str], rows: Sequence[Row], settings: Mapping[str, Sequence[Any]]
) -> dict[str, Any]:
    """Return the comparison for a script: figures in the units that their names say."""
    figures = {
        row.figure.name: {
            "values": list(row.values),
            "differences": [row.difference(i) for i in range(len(row.values))],
        }
        for row in rows
    }
    return {"runs": list(names), "figures": figures, "settings": dict(settings)}


def _cells(row: Row) -> tuple[str, list[str]]:
    cells = [_shown(row.figure, row.values[0])]
    for i in range(1, len(row.values)):
        difference = row.difference(i)
        extra = "" if difference is None else f"\n{_signed(row.figure, difference)}"
        cells.append(f"{_shown(row.figure, row.values[i])}{extra}")
    return row.figure.name, cells


def _blocks(
    width: int, names: Sequence[str], lines: Sequence[tuple[str, Sequence[str]]], heading: str
) -> Iterator[Table]:
    """Yield tables that fit the width: the first run stands in each, the others follow in turn."""
    widths = [
        max([len(name), *(len(part) for _, cells in lines for part in cells[i].split("\n"))]) + 2
        for i, name in enumerate(names)
    ]
    free = width - max(len(name) for name, _ in lines) - 2 - widths[0]
    shown: list[int] = []
    for i in range(1, len(names)):
        if shown and sum(widths[j] for j in shown) + widths[i] > free:
            yield _table(names, lines, [0, *shown], heading)
            shown = []
        shown.append(i)
    yield _table(names, lines, [0, *shown], heading)


def _table(
    names: Sequence[str],
    lines: Sequence[tuple[str, Sequence[str]]],
    shown: Sequence[int],
    heading: str,
) -> Table:
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column(heading, no_wrap=True)
    for i in shown:
        table.add_column(Text(names[i]), justify="right", no_wrap=True)
    for name, cells in lines:
        table.add_row(name, *(Text(cells[i]) for i in shown))
    return table


def _shown(figure: Figure, value: float | None) -> str:
    return NONE if value is None else f"{value:.{figure.decimals}f}"


def _signed(figure: Figure, difference: float) -> str:
    rounded = round(difference, figure.decimals)
    return "=" if rounded == 0 else f"{rounded:+.{figure.decimals}f}"


def _short(value: Any) -> str:
    text = value if isinstance(value, str) else NONE if value is None else json.dumps(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"


def _say(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
