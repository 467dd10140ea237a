"""`tieline export-helics`, `broker`, `join` and `gather`: federates that tieline does not start."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from tieline.cli.options import Debug, Reference, Settings
from tieline.cli.run import planned
from tieline.console import reporting, say

PORT = 23_404
"""Where HELICS's own programs look for a broker."""

Port = Annotated[int, typer.Option(min=1024, max=32_000, help="where the broker listens")]
Target = Annotated[Path, typer.Option(metavar="DIR", help="the result folder, new or empty")]


def export_helics(
    reference: Reference,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder for the files; else helics/NAME")
    ] = None,
    port: Port = PORT,
    settings: Settings = None,
    debug: Debug = False,
) -> None:
    """Write a run as HELICS's own runner and federate files, for `helics run`."""
    from tieline.experiment.export import export_helics as export
    from tieline.experiment.export import single_run

    with reporting(debug):
        plan = planned(reference, settings or [])
        folder = out or Path("helics") / plan.study.name
        runner = export(single_run(plan, "export-helics"), folder, port)
        say(f"helics run --path={runner}\ntieline gather {folder} --out RESULT")


def gather(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="folders of one run's federates")
    ],
    out: Target,
    debug: Debug = False,
) -> None:
    """Make one result of what federates have left in folders of their own."""
    from tieline.experiment.gather import gather as gather_folders
    from tieline.experiment.report import report as write_report

    with reporting(debug):
        write_report(gather_folders(folders, out), Console())
