"""`tieline reproduce`: what the paper shows, computed anew, with a verdict on each statement."""

from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import Debug
from tieline.console import console_of, reporting, say


def reproduce(
    quick: Annotated[
        bool, typer.Option("--quick", help="fewer points and shorter runs, under a minute")
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="ITEM", help="an item; may be given several times"),
    ] = None,
    list_: Annotated[bool, typer.Option("--list", help="list the items and end")] = False,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="write the verdicts as Markdown, too")
    ] = False,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="folder for page, verdicts, figures and runs")
    ] = Path("results/reproduce"),
    debug: Debug = False,
) -> None:
    """Compute what the paper shows; write a page with figures and verdicts on its statements."""
    with reporting(debug):
        from tieline.paper.commands import give, list_of

        if list_:
            say(list_of())
            return
        give(only or (), out, quick, markdown, console_of())
