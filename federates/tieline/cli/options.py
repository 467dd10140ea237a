"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

Reference = Annotated[str, typer.Argument(metavar="CONFIG|NAME", help="a file, or a shipped name")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="change a setting, such as grid.pss.gain=5"),
]
Debug = Annotated[bool, typer.Option("--debug", help="show where in the code an error arose")]
Case = Annotated[str, typer.Argument(metavar="CASE", help="a shipped case, or a case's folder")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="folder for tables and plots")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON object instead of a table")]
