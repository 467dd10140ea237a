"""`tieline compare` and `tieline plot`: results side by side, and what they recorded."""

import json
from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import AsJson, Debug
from tieline.console import console_of, reporting, say

Results = Annotated[
    list[str],
    typer.Argument(metavar="RESULT...", help="a run, a whole sweep, or FOLDER:LABEL for a point"),
]
Picture = Annotated[
    Path, typer.Option("-o", "--out", metavar="FILE", help="the picture: .png, .svg or .pdf")
]


def compare(
    results: Results,
    unit: Annotated[
        str | None, typer.Option(help="whose speed and voltage are drawn; else the case's choice")
    ] = None,
    out: Picture = Path("compare.png"),
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Show figures of runs side by side, with differences from the first; draw them in one plot."""
    with reporting(debug):
        from tieline.compare.commands import compare as compare_runs

        comparison = compare_runs(results, unit, out, console_of(quiet=as_json))
        if as_json:
            typer.echo(json.dumps(comparison, indent=2, ensure_ascii=False))


def plot(
    result: Annotated[
        str, typer.Argument(metavar="RESULT", help="a run, a sweep, or FOLDER:LABEL")
    ],
    quantities: Annotated[
        list[str],
        typer.Argument(metavar="QUANTITY...", help="such as speed_pu.G26, f_hz.B61, 'vt_pu.G1*'"),
    ],
    out: Picture = Path("plot.png"),
    begin: Annotated[
        float | None, typer.Option("--from", metavar="S", help="first instant")
    ] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="S", help="last instant")] = None,
    debug: Debug = False,
) -> None:
    """Draw recorded quantities of a run against time, one panel a kind of quantity."""
    with reporting(debug):
        from tieline.compare.commands import plot as plot_quantities

        say(str(plot_quantities(result, quantities, out, (begin, end))))
