"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer


def shipped_names(incomplete: str) -> list[str]:
    """Return the shipped experiments whose names begin so, for the shell to complete."""
    from tieline.resources import shipped

    names = sorted(path.stem for path in shipped("configs").glob("*.yaml"))
    return [name for name in names if name.startswith(incomplete)]


Reference = Annotated[
    str,
    typer.Argument(
        metavar="CONFIG|NAME", help="a file, or a shipped name", autocompletion=shipped_names
    ),
]
OptionalReference = Annotated[
    str | None,
    typer.Argument(
        metavar="CONFIG|NAME", help="a file, or a shipped name", autocompletion=shipped_names
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="change a setting, such as grid.pss.gain=5"),
]
Core = Annotated[
    str | None,
    typer.Option(
        metavar="zmq|tcp|inproc|local", help="how the federates meet; local is without HELICS"
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(metavar="N", help="points of a sweep at once; without it, one a core"),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="print the result folder alone")]
Debug = Annotated[bool, typer.Option("--debug", help="show where in the code an error arose")]
Case = Annotated[str, typer.Argument(metavar="CASE", help="a shipped case, or a case's folder")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="folder for tables and plots")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON object instead of a table")]
