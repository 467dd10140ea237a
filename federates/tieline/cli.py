"""The command line: every `tieline` command, thin; what it does stands in the packages."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

import tieline
from tieline.console import reporting, say
from tieline.errors import InputError
from tieline.experiment.load import load_experiment, shipped_experiments
from tieline.resources import shipped
from tieline.topology_cli import topology
from tieline.yaml_lines import load as load_yaml

if TYPE_CHECKING:
    from tieline.experiment.plan import Plan
    from tieline.experiment.run import Launch
    from tieline.linear.study import Study

HELP = """A power grid and the packet network that carries its measurements, simulated together.

`tieline list` shows the experiments that come with it; `tieline run NAME` runs one.
"""
WITHOUT_NAME = """Give the name of a shipped experiment, or the path of a YAML file of your own:

    tieline run g26_trip_smoke                     a short one to begin with
    tieline run g26_trip --set grid.pss.gain=5     a shipped one with a setting changed
    tieline run my_experiment.yaml --out my_result
"""

app = typer.Typer(help=HELP, add_completion=False, rich_markup_mode=None)
app.add_typer(topology)

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


Case = Annotated[str, typer.Argument(metavar="CASE", help="a shipped case, or a case's folder")]
Pss = Annotated[str, typer.Option(help="none, case, standard, generalized, or a model's name")]
Gain = Annotated[float | None, typer.Option(help="gain K; the case's own without it")]
Beta1 = Annotated[float | None, typer.Option(help="share of the speed against the average")]
Beta2 = Annotated[float | None, typer.Option(help="share of the average against synchronous")]
OfWhat = Annotated[str, typer.Option(metavar="rotor|sensor", help="what the average is formed of")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="folder for tables and plots")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON object instead of a table")]


@app.command()
def modes(
    case: Case,
    pss: Pss = "generalized",
    gain: Gain = None,
    beta1: Beta1 = None,
    beta2: Beta2 = None,
    average: OfWhat = "sensor",
    delay: Annotated[float, typer.Option(help="delay of the average, s")] = 0.0,
    sweep: Annotated[
        str | None,
        typer.Option(metavar="NAME=FIRST:LAST:POINTS", help="root locus, as beta1=0:1:21"),
    ] = None,
    controls: Annotated[bool, typer.Option(help="show modes of controls, too")] = False,
    out: Out = None,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Show the modes of a case: frequency, damping, kind, shape; with delay, or along a sweep."""
    with reporting(debug):
        from tieline.linear.commands import give, modes_answer

        study = _study(case, pss, gain, beta1, beta2, average)
        answer = modes_answer(study, delay, sweep, controls)
        give(answer, out, f"results/modes-{Path(case).name}", as_json, Console())


@app.command()
def freqresp(
    case: Case,
    unit: Annotated[str, typer.Option(help="the unit whose stabiliser's loop is opened")],
    pss: Pss = "generalized",
    gain: Annotated[float, typer.Option(help="gain for margins and the Nyquist plot")] = 9.0,
    beta1: Beta1 = None,
    beta2: Beta2 = None,
    average: OfWhat = "sensor",
    delay: Annotated[
        list[float] | None, typer.Option(help="delay of the average, s; may be given several times")
    ] = None,
    band: Annotated[str, typer.Option(metavar="LOW:HIGH", help="frequencies, Hz")] = "0.01:10",
    out: Out = None,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Show one unit's open loop from V_ref to its stabiliser's output, K = 1, the only one."""
    with reporting(debug):
        from tieline.linear.commands import freqresp_answer, give

        study = _study(case, pss, 1.0, beta1, beta2, average, unit)
        answer = freqresp_answer(study, unit, delay or [0.0], gain, _band(band))
        give(answer, out, f"results/freqresp-{Path(case).name}-{unit}", as_json, Console())


@app.command()
def damping(
    folder: Annotated[Path, typer.Argument(metavar="RESULT", help="a run's result folder")],
    unit: Annotated[
        list[str] | None, typer.Option(help="a unit; may be given several times")
    ] = None,
    out: Out = None,
    as_json: AsJson = False,
    debug: Debug = False,
) -> None:
    """Show the time-varying damping coefficient D(t) of units along a result."""
    with reporting(debug):
        from tieline.linear.commands import damping_answer, give

        answer = damping_answer(folder, unit or ())
        give(answer, out, str(folder / "damping"), as_json, Console())


def _study(
    case: str,
    pss: str,
    gain: float | None,
    beta1: float | None,
    beta2: float | None,
    average: str,
    unit: str | None = None,
) -> "Study":
    from tieline.linear.study import Study

    units = "all" if unit is None else (unit,)
    return Study(case, pss, gain, beta1, beta2, average, units=units)


def _band(text: str) -> tuple[float, float]:
    low, _, high = text.partition(":")
    try:
        band = float(low), float(high)
    except ValueError:
        band = 0.0, 0.0
    if not 0 < band[0] < band[1] < float("inf"):
        raise InputError(f"--band must be LOW:HIGH in Hz, such as 0.01:10 (got '{text}')")
    return band


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
