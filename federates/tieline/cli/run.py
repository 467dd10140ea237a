"""`tieline run`, `list` and `validate`: experiments, run and checked."""

import json
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tieline.cli.options import (
    AsJson,
    Core,
    Debug,
    Jobs,
    OptionalReference,
    Quiet,
    Reference,
    Settings,
)
from tieline.console import console_of, reporting, say
from tieline.errors import InputError
from tieline.garbage import collecting_later
from tieline.threads import one_thread

if TYPE_CHECKING:
    from rich.console import Console

    from tieline.experiment.load import Study
    from tieline.experiment.plan import Plan
    from tieline.experiment.run import Launch
    from tieline.experiment.sweep_run import Runner
    from tieline.sweeps.single import Steps

MOST_LABELS = 12

WITHOUT_NAME = """Give the name of a shipped experiment, or the path of a YAML file of your own:

    tieline run g26_trip_smoke                     a short one to begin with
    tieline run g26_trip --set grid.pss.gain=5     a shipped one with a setting changed
    tieline run my_experiment.yaml --out my_result
"""


MOST_DRAWN = 24
"""Points of a sweep that a table and plots can show; of more, their spread is shown."""


def run(
    reference: OptionalReference = None,
    settings: Settings = None,
    core: Core = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="the result folder; else one in results/")
    ] = None,
    jobs: Jobs = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Run an experiment and write its result folder, with a table, plots and a page.

    A sweep runs its points at once, as `tieline sweep` does.
    """
    # Before any import of NumPy, and for the federates that are forked from this process.
    os.environ.update(one_thread(os.environ))
    with collecting_later():
        from tieline.experiment.load import load_experiment

    with reporting(debug):
        if reference is None:
            say(WITHOUT_NAME)
            say(catalogue())
            raise typer.Exit(InputError.exit_code)
        options = [*(settings or ()), *([f"federation.core={core}"] if core else ())]
        with collecting_later():
            study = load_experiment(reference, options)
        if study.is_sweep:
            from tieline.sweeps.start import with_core

            run_sweep_plan(with_core(study), out, jobs, None, False, quiet, as_json)
        else:
            _run_single(study, out, quiet, as_json)


def list_(as_json: AsJson = False) -> None:
    """List the shipped experiments, each with the question that it answers, and the cases."""
    with reporting():
        if as_json:
            typer.echo(json.dumps(shipped_things(), indent=2, ensure_ascii=False))
        else:
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
    from tieline.experiment.load import load_experiment

    return prepared(load_experiment(reference, settings))


def prepared(study: "Study") -> "Plan":
    """Return the plan of a study, checked against its case and network."""
    from tieline.experiment.plan import prepare

    return prepare(study)


def launcher() -> "Launch":
    """Return what starts the federates."""
    from tieline.sweeps.single import launch_here

    return launch_here


def steps(core: str) -> "tuple[Steps, Steps]":
    """Return what makes this process ready to be forked for a check, and for federates."""
    from tieline.sweeps.single import own_steps, shared_steps

    return shared_steps(), own_steps(core)


def sweep_runner(plan: "Plan", jobs: int | None, scheduler: str | None) -> "Runner":
    """Return what runs the points of a sweep."""
    from tieline.sweeps.start import runner_of

    return runner_of(plan, jobs, scheduler)


def shipped_things() -> dict[str, list[dict[str, object]]]:
    """Return the shipped experiments and cases, as `tieline list --json` prints them."""
    from tieline.experiment.layers import read_layers, shipped_experiments
    from tieline.resources import shipped
    from tieline.yaml_lines import load as load_yaml

    experiments: list[dict[str, object]] = []
    for path in shipped_experiments():
        data = read_layers(path).data
        question = " ".join(data["question"].split())
        experiments.append({"name": path.stem, "question": question, "is_sweep": "sweep" in data})
    cases: list[dict[str, object]] = [
        {"name": path.parent.name, "title": load_yaml(path).data.get("title", "")}
        for path in sorted(shipped("cases").glob("*/case.yaml"))
    ]
    return {"experiments": experiments, "cases": cases}


def catalogue() -> str:
    """Return the list of shipped experiments and cases."""
    things = shipped_things()
    lines = ["Experiments:"]
    for entry in things["experiments"]:
        sweep = "  (a sweep)" if entry["is_sweep"] else ""
        lines += [f"  {entry['name']}{sweep}", f"      {entry['question']}"]
    lines.append("Cases:")
    lines += [f"  {entry['name']}: {entry['title']}" for entry in things["cases"]]
    return "\n".join(lines)


def run_sweep_plan(
    study: "Study",
    out: Path | None,
    jobs: int | None,
    scheduler: str | None,
    fresh: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Run a sweep, show its course and its table, and tell how to go on when it is interrupted."""
    from tieline.experiment.progress import shown_progress
    from tieline.experiment.run import check_target, default_target
    from tieline.experiment.sweep_run import PointsFailedError, run_sweep

    if out is not None:
        check_target(out)
    console = console_of(quiet=quiet or as_json)
    plan = prepared(study)
    runner = sweep_runner(plan, jobs, scheduler)
    target = out or default_target(study.name)
    console.print(study.question, markup=False, highlight=False, soft_wrap=True)
    try:
        with shown_progress(study.points, console) as listener:
            run_sweep(plan, target, runner, listener, fresh)
    except PointsFailedError as error:
        if len(error.failures) < len(plan.runs):
            _show(target, console, quiet, as_json)
        elif as_json:
            _print_json(target)
        raise
    except KeyboardInterrupt:
        typer.echo(
            f"finished points are kept; go on with: tieline sweep --resume {target}", err=True
        )
        raise
    _show(target, console, quiet, as_json)


def _run_single(study: "Study", out: Path | None, quiet: bool, as_json: bool) -> None:
    from tieline.experiment.artist import Artist
    from tieline.experiment.report import report as write_report
    from tieline.experiment.run import check_target

    if out is not None:
        check_target(out)
    console = console_of(quiet=quiet or as_json)
    with Artist() as artist:
        folder = _executed(study, out, console, as_json)
        write_report(folder, console, artist.draw)
    _answer(folder, quiet, as_json)


def _executed(study: "Study", out: Path | None, console: "Console", as_json: bool) -> Path:
    """Check and run an experiment without a sweep, show its course and return its folder."""
    from tieline.experiment.progress import shown_progress
    from tieline.experiment.run import RunFailedError, default_target, execute_task
    from tieline.sweeps.single import planned as task_of

    point = study.points[0]
    with collecting_later():
        task = task_of(study, *steps(point.experiment.federation.core))
    console.print(study.question, markup=False, highlight=False, soft_wrap=True)
    try:
        with shown_progress(study.points, console) as listener:
            on_time = listener.on_time and partial(listener.on_time, point)
            return execute_task(task, out or default_target(study.name), launcher(), on_time)
    except RunFailedError as error:
        if as_json:
            _print_json(error.folder)
        raise


def _show(folder: Path, console: "Console", quiet: bool, as_json: bool) -> None:
    """Write table and plots of a sweep, and show it as was asked for."""
    from tieline.experiment.report import report as write_report
    from tieline.experiment.results import read_runs

    if len(read_runs(folder)) > MOST_DRAWN:
        _show_spread(folder, console)
    else:
        write_report(folder, console)
    _answer(folder, quiet, as_json)


def _answer(folder: Path, quiet: bool, as_json: bool) -> None:
    if as_json:
        _print_json(folder)
    elif quiet:
        typer.echo(folder)


def _show_spread(folder: Path, console: "Console") -> None:
    """Show what many points are like together, and where each stands."""
    from tieline.experiment.points_table import spread

    lines = [
        spread(folder).to_string(float_format=lambda value: f"{value:.6g}"),
        f"table   {folder / 'points.csv'}",
        f"plots   of all points: tieline report {folder}",
        f"plots   of some: tieline plot {folder}:LABEL QUANTITY...",
    ]
    console.print("\n".join(lines), markup=False, highlight=False, soft_wrap=True)


def _print_json(folder: Path) -> None:
    from tieline.experiment.answer import answer

    typer.echo(json.dumps(answer(folder), indent=2, ensure_ascii=False))
