"""`tieline modes`, `freqresp` and `damping`: what the linearised equations say."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tieline.cli.options import AsJson, Case, Debug, Out
from tieline.console import console_of, reporting
from tieline.errors import InputError

if TYPE_CHECKING:
    from tieline.linear.study import Study

Pss = Annotated[str, typer.Option(help="none, case, standard, generalized, or a model's name")]
Gain = Annotated[float | None, typer.Option(help="gain K; the case's own without it")]
Beta1 = Annotated[float | None, typer.Option(help="share of the speed against the average")]
Beta2 = Annotated[float | None, typer.Option(help="share of the average against synchronous")]
OfWhat = Annotated[str, typer.Option(metavar="rotor|sensor", help="what the average is formed of")]


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
        give(answer, out, f"results/modes-{Path(case).name}", as_json, console_of())


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
        give(answer, out, f"results/freqresp-{Path(case).name}-{unit}", as_json, console_of())


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
        give(answer, out, str(folder / "damping"), as_json, console_of())


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
