"""`tieline log`: what the processes of a run said, in the order of time."""

from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import Debug
from tieline.console import reporting
from tieline.errors import InputError


def log(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="the result folder of a run")],
    process: Annotated[
        str | None, typer.Option(metavar="NAME", help="of one process alone: grid, broker, ...")
    ] = None,
    level: Annotated[
        str, typer.Option(metavar="LEVEL", help="the least: debug, info, warning or error")
    ] = "debug",
    from_s: Annotated[
        float | None, typer.Option("--from", metavar="S", help="simulated time to begin with, s")
    ] = None,
    to_s: Annotated[
        float | None, typer.Option("--to", metavar="S", help="simulated time to end with, s")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the JSON lines")] = False,
    debug: Debug = False,
) -> None:
    """Print the merged log of a run: simulated time, wall time (UTC), level, process, message."""
    from tieline.logs import LEVELS, chosen, processes_of, records, shown

    with reporting(debug):
        if level not in LEVELS:
            raise InputError(f"--level {level}: give one of {', '.join(LEVELS)}")
        known = processes_of(folder)
        if process is not None and known and process not in known:
            raise InputError(f"--process {process}: {folder} has logs of {', '.join(known)}")
        for record in chosen(records(folder), process, level, from_s, to_s):
            typer.echo(record.to_line().decode() if as_json else shown(record))
