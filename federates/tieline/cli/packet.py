"""`tieline packet`: what became of one packet of a result."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import AsJson, Debug
from tieline.console import console_of, reporting


def packet(
    folder: Annotated[Path, typer.Argument(metavar="RESULT", help="the result folder of a run")],
    source: Annotated[str, typer.Option("--from", metavar="PMU", help="its bus or its name")],
    destination: Annotated[str, typer.Option("--to", metavar="UNIT", help="the controller's")],
    sequence: Annotated[
        int | None, typer.Option(metavar="N", help="number of the frame, from 0")
    ] = None,
    sent_at: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="or an instant: the last frame measured up to it"),
    ] = None,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Repeat the network of a run and say what became of one packet, link by link."""
    from tieline.fates import Asked, packet_fate, show
    from tieline.units import quantity, seconds_to_ns

    with reporting(debug):
        sent_ns = None if sent_at is None else seconds_to_ns(quantity(sent_at, "time"))
        found = packet_fate(folder, Asked(source, destination, sequence, sent_ns))
        if as_json:
            typer.echo(json.dumps(asdict(found), indent=2, ensure_ascii=False))
        else:
            show(found, console_of())
