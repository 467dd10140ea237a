"""`tieline reproduce`: computes, shows and writes."""

import time
from collections.abc import Sequence
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

import tieline
from tieline.errors import TielineError
from tieline.experiment.overrides import shortest
from tieline.paper.catalogue import ITEMS
from tieline.paper.item import Item
from tieline.paper.markdown import markdown
from tieline.paper.page import write_page
from tieline.paper.reproduce import (
    RUNS,
    VERDICTS_CSV,
    VERDICTS_JSON,
    Result,
    check_target,
    chosen,
    counted,
    reproduce,
    save_verdicts,
)
from tieline.paper.runs import Runs
from tieline.paper.statement import Verdict

MARKDOWN = "verdicts.md"
STYLES = {Verdict.REPRODUCED: "green", Verdict.DIFFERENT: "yellow", Verdict.NOT: "red"}


def give(
    only: Sequence[str], target: Path, quick: bool, as_markdown: bool, console: Console
) -> None:
    """Compute items and write page, verdicts and figures; show table and paths.

    Args:
        only: ids of items; none for all.
        target: the folder to write.
        quick: fewer points, shorter runs, pure delays.
        as_markdown: whether to write the verdicts as Markdown, too.
        console: where to print.

    Raises:
        InputError: there is no such item, or the folder is taken.
        TielineError: an item could not be computed; what could is written.
    """
    items = chosen(ITEMS, only)
    check_target(target)
    began_s = time.monotonic()
    with Runs(target / RUNS, quick) as runs:
        results = reproduce(items, target, runs, lambda line: _say(console, line))
    wall_s = time.monotonic() - began_s
    form = "the short form (fewer points, shorter runs, pure delays)" if quick else "the full form"
    about = f"tieline {tieline.__version__}, {form}, {wall_s:.0f} s."
    facts = {"tieline": tieline.__version__, "quick": quick, "wall_s": round(wall_s, 1)}
    save_verdicts(results, target, facts)
    paths = [write_page(results, target, about), target / VERDICTS_JSON, target / VERDICTS_CSV]
    if as_markdown:
        paths.append(target / MARKDOWN)
        paths[-1].write_text(markdown(results), encoding="utf-8")
    console.print(table_of(results))
    _say(console, f"{counted(results)}; {wall_s:.0f} s")
    for path in paths:
        _say(console, shortest(path))
    _raise_first(results)


def table_of(results: Sequence[Result]) -> Table:
    """Return the verdicts as a table for a terminal."""
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    for heading in ("id", "here", "stated", "verdict"):
        table.add_column(heading, no_wrap=heading != "stated")
    for result in results:
        for row in result.rows:
            style = STYLES[row.verdict]
            verdict = f"[{style}]{row.verdict.value}[/{style}]"
            table.add_row(row.statement.id, row.ours, row.statement.paper, verdict)
    return table


def list_of(items: Sequence[Item] = ITEMS) -> str:
    """Return the items with the number of their statements, as text."""
    width = max(len(item.id) for item in items)
    return "\n".join(
        f"{item.id:{width}}  {item.title} ({len(item.statements)} statements)" for item in items
    )


def _raise_first(results: Sequence[Result]) -> None:
    errors: list[TielineError] = [result.error for result in results if result.error is not None]
    if errors:
        raise errors[0]


def _say(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
