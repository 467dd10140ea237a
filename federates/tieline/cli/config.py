"""`tieline schema`, `show`, `new` and `cases`: what an experiment may say, and what it says."""

import json
from pathlib import Path
from typing import Annotated

import typer

from tieline.cli.options import AsJson, Debug, Reference, Settings
from tieline.console import reporting, say


def schema(
    markdown: Annotated[
        bool, typer.Option("--markdown", help="the reference page of every setting instead")
    ] = False,
    debug: Debug = False,
) -> None:
    """Print the JSON Schema of an experiment file, for editors and validators."""
    from tieline.experiment.json_schema import as_text, json_schema
    from tieline.experiment.reference import reference_page

    with reporting(debug):
        typer.echo(reference_page() if markdown else as_text(json_schema()), nl=False)


def show(
    reference: Reference, settings: Settings = None, as_json: AsJson = False, debug: Debug = False
) -> None:
    """Print an experiment in full: what it extends, --set, every default, each point of a sweep."""
    from tieline.experiment.load import load_experiment
    from tieline.experiment.show import as_data, as_yaml

    with reporting(debug):
        study = load_experiment(reference, settings or [])
        typer.echo(
            json.dumps(as_data(study), indent=2) + "\n" if as_json else as_yaml(study), nl=False
        )


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="of the experiment and its file")],
    case: Annotated[str, typer.Option(help="a shipped case, or a case's folder")] = "miniwecc",
    folder: Annotated[
        Path, typer.Option("--in", metavar="DIR", help="the folder that the file goes to")
    ] = Path(),
    debug: Debug = False,
) -> None:
    """Write NAME.yaml, a commented experiment to start from; it is valid and runs as it is."""
    from tieline.experiment.starter import write_starter

    with reporting(debug):
        path = write_starter(name, case, folder)
        say(f"{path}\ntieline validate {path}\ntieline run {path}")


def cases(as_json: AsJson = False, debug: Debug = False) -> None:
    """List the shipped cases: title, size, and the networks that come with each."""
    from tieline.experiment.case_list import as_text, case_rows

    with reporting(debug):
        rows = case_rows()
        if as_json:
            typer.echo(json.dumps([row.data() for row in rows], indent=2))
            return
        say(as_text(rows))
