"""`tieline report`: table, plots and page of a result folder."""

from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import Debug
from tieline.console import console_of, reporting


def report(
    folder: Annotated[Path, typer.Argument(metavar="RESULT", help="a result folder")],
    debug: Debug = False,
) -> None:
    """Write table, plots and page of a result folder again, and show the table."""
    from tieline.experiment.report import report as write_report

    with reporting(debug):
        write_report(folder, console_of())
