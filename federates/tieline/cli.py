"""The command line: `tieline run`, `list`, `validate`, `report` and `models`."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

import tieline
from tieline.errors import InputError, TielineError
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.resources import shipped
from tieline.yaml_lines import load as load_yaml

if TYPE_CHECKING:
    from tieline.experiment.plan import Plan
    from tieline.experiment.run import Launch

HELP = """A power grid and the packet network that carries its measurements, simulated together.

`tieline list` shows the experiments that come with it; `tieline run NAME` runs one.
"""
WITHOUT_NAME = """Give the name of a shipped experiment, or the path of a YAML file of your own:

    tieline run g26_trip_smoke                     a short one to begin with
    tieline run g26_trip --set grid.pss.gain=5     a shipped one with a setting changed
    tieline run my_experiment.yaml --out my_result
"""
INTERRUPTED = 130
UNEXPECTED = 1

app = typer.Typer(help=HELP, add_completion=False, rich_markup_mode=None)

Reference = Annotated[str, typer.Argument(metavar="CONFIG|NAME", help="a file, or a shipped name")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="change a setting, such as grid.pss.gain=5"),
]
Debug = Annotated[bool, typer.Option("--debug", help="show where in the code an error arose")]


def main() -> None:
    """Run the command line."""
    app(prog_name="tieline")


@app.callback(invoke_without_command=True)
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, help="print the version and end")
    ] = False,
) -> None:
    if version:
        say(f"tieline {tieline.__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        say(context.get_help())
        raise typer.Exit(InputError.exit_code)


@app.command()
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
    """Run an experiment and write its result folder, with a table and plots."""
    with reporting(debug):
        if reference is None:
            say(WITHOUT_NAME)
            say(catalogue())
            raise typer.Exit(InputError.exit_code)
        options = [*(settings or ()), *([f"federation.core={core}"] if core else ())]
        _run(reference, options, out)


@app.command("list")
def list_() -> None:
    """List the shipped experiments, each with the question that it answers, and the cases."""
    with reporting():
        say(catalogue())


@app.command()
def validate(reference: Reference, settings: Settings = None, debug: Debug = False) -> None:
    """Check an experiment with its case and network, and start nothing."""
    with reporting(debug):
        plan = planned(reference, settings or [])
        labels = ", ".join(run.point.label for run in plan.runs) if plan.study.is_sweep else ""
        say(
            f"{plan.study.name} is valid: {len(plan.runs)} to run" + (f" ({labels})" * bool(labels))
        )


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="RESULT", help="a result folder")],
    debug: Debug = False,
) -> None:
    """Write table and plots of a result folder again, and show the table."""
    from tieline.experiment.report import report as write_report

    with reporting(debug):
        write_report(folder, Console())


@app.command()
def models(
    role: Annotated[
        str | None, typer.Argument(help="machine, exciter, governor or pss; all without it")
    ] = None,
    debug: Debug = False,
) -> None:
    """List the device models: source, states, and each parameter with unit, bounds and meaning."""
    from tieline.grid.models.base import ROLES
    from tieline.grid.models.catalogue import as_text, entries

    with reporting(debug):
        if role is not None and role not in ROLES:
            raise InputError(f"no role '{role}': give one of {', '.join(ROLES)}")
        say("\n\n".join(as_text(entry) for entry in entries(role)))


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
        data = load_yaml(path).data
        lines += [f"  {path.stem}", f"      {' '.join(data['question'].split())}"]
    lines.append("Cases:")
    for path in sorted(shipped("cases").glob("*/case.yaml")):
        lines.append(f"  {path.parent.name}: {load_yaml(path).data.get('title', '')}")
    return "\n".join(lines)


def say(text: str) -> None:
    """Print text as it is."""
    Console().print(text, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def reporting(debug: bool = False) -> Iterator[None]:
    """Turn an error into its message and exit code, with its traceback when debugging."""
    try:
        yield
    except (typer.Exit, typer.Abort):
        raise
    except KeyboardInterrupt:
        _complain("interrupted", debug)
        raise typer.Exit(INTERRUPTED) from None
    except TielineError as error:
        _complain(str(error), debug)
        raise typer.Exit(error.exit_code) from None
    except Exception as error:
        advice = "" if debug else "; --debug shows where it arose"
        _complain(f"unexpected {type(error).__name__}: {error}{advice}", debug)
        raise typer.Exit(UNEXPECTED) from None


def _complain(message: str, debug: bool) -> None:
    console = Console(stderr=True)
    if debug:
        console.print(traceback.format_exc(), markup=False, highlight=False, soft_wrap=True)
    console.print(message, markup=False, highlight=False, soft_wrap=True)


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
