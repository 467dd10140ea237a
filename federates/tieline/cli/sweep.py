"""`tieline sweep`: the points of an experiment's sweep, several at once or on a cluster."""

from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import AsJson, Core, Debug, Jobs, OptionalReference, Quiet, Settings
from tieline.cli.run import run_sweep_plan
from tieline.console import reporting
from tieline.errors import InputError


def sweep(
    reference: OptionalReference = None,
    settings: Settings = None,
    core: Core = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="the result folder, new or to go on with; else results/"),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="go on with a sweep; CONFIG is not needed then"),
    ] = None,
    jobs: Jobs = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="run on the workers of a Dask scheduler"),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="run finished points again")] = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Run the points of a sweep at once; what is finished in the folder is not run again.

    The folder gets one folder a point, and points.csv and points.parquet with one row a point. A
    failed point does not stop the others; they are listed at the end, with a non-zero exit code.
    """
    from tieline.sweeps.start import load_sweep, resumed

    with reporting(debug):
        if resume is not None and out is not None:
            raise InputError("give --out or --resume, not both: both name the result folder")
        options = list(settings or ())
        if reference is None:
            if resume is None:
                raise InputError("give CONFIG, or --resume DIR with the folder of a sweep")
            reference, before = resumed(resume)
            options = [*before, *options]
        options += [f"federation.core={core}"] if core else []
        study = load_sweep(reference, options)
        run_sweep_plan(study, resume or out, jobs, scheduler, fresh, quiet, as_json)
