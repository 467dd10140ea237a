"""`tieline run`, `list` and `validate`: experiments, run and checked."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from tieline.cli.options import Debug, Reference, Settings
from tieline.console import reporting, say
from tieline.errors import InputError
from tieline.experiment.layers import read_layers
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.resources import shipped
from tieline.yaml_lines import load as load_yaml

if TYPE_CHECKING:
    from tieline.experiment.plan import Plan
    from tieline.experiment.run import Launch

MOST_LABELS = 12

WITHOUT_NAME = """Give the name of a shipped experiment, or the path of a YAML file of your own:

    tieline run g26_trip_smoke                     a short one to begin with
    tieline run g26_trip --set grid.pss.gain=5     a shipped one with a setting changed
    tieline run my_experiment.yaml --out my_result
"""


def run(
    reference: Annotated[
        str | None, typer.Argument(metavar="CONFIG|NAME", help="a file, or a shipped name")
    ] = None,
    settings: Settings = None,
    core: Annotated[
        str | None,
        typer.Option(
            metavar="zmq|tcp|inproc|local", help="how the federates meet; local is without HELICS"
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="the result folder; else one in results/")
    ] = None,
    debug: Debug = False,
) -> None:
    """Run an experiment and write its result folder, with a table, plots and a page."""
    with reporting(debug):
        if reference is None:
            say(WITHOUT_NAME)
            say(catalogue())
            raise typer.Exit(InputError.exit_code)
        options = [*(settings or ()), *([f"federation.core={core}"] if core else ())]
        _run(reference, options, out)


def list_() -> None:
    """List the shipped experiments, each with the question that it answers, and the cases."""
    with reporting():
        say(catalogue())


def validate(reference: Reference, settings: Settings = None, debug: Debug = False) -> None:
    """Check an experiment with its case and network, and start nothing."""
    with reporting(debug):
        plan = planned(reference, settings or [])
        labels = [run.point.label for run in plan.runs]
        if len(labels) > MOST_LABELS:
            labels[2:-1] = ["..."]
        listed = f" ({', '.join(labels)})" if plan.study.is_sweep else ""
        say(f"{plan.study.name} is valid: {len(plan.runs)} to run{listed}")


def planned(reference: str, settings: list[str]) -> "Plan":
    """Return the checked plan of an experiment."""
    from tieline.experiment.plan import prepare

    return prepare(load_experiment(reference, settings))


def launcher() -> "Launch":
    """Return what starts the federates."""
    from tieline.experiment.launch import launch

    return launch


def catalogue() -> str:
    """Return the list of shipped experiments and cases."""
    lines = ["Experiments:"]
    for path in shipped_experiments():
        question = " ".join(read_layers(path).data["question"].split())
        lines += [f"  {path.stem}", f"      {question}"]
    lines.append("Cases:")
    for path in sorted(shipped("cases").glob("*/case.yaml")):
        lines.append(f"  {path.parent.name}: {load_yaml(path).data.get('title', '')}")
    return "\n".join(lines)


def _run(reference: str, options: list[str], out: Path | None) -> None:
    from tieline.experiment.progress import shown_progress
    from tieline.experiment.report import report as write_report
    from tieline.experiment.run import check_target, default_target, execute

    if out is not None:
        check_target(out)
    plan = planned(reference, options)
    target = out or default_target(plan.study.name)
    console = Console()
    say(plan.study.question)
    with shown_progress(plan.study.points, console) as on_progress:
        folder = execute(plan, target, launcher(), on_progress)
    write_report(folder, console)
