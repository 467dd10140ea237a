"""What `tieline compare` and `tieline plot` do."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from tieline.compare import table
from tieline.compare.differences import figures_of, settings_that_differ
from tieline.compare.plots import Window, check_file, draw
from tieline.compare.quantities import Quantity, chosen, recorded
from tieline.compare.select import named, runs_of
from tieline.errors import InputError
from tieline.experiment.overrides import shortest
from tieline.experiment.results import Run
from tieline.problems import near

MOST_RUNS = 24
"""More than these cannot be told apart side by side; points.csv of a sweep holds them all."""


def compare(
    references: Sequence[str], unit: str | None, picture: Path, console: Console
) -> dict[str, Any]:
    """Show runs side by side, draw them over each other, and return the comparison as data.

    Args:
        references: as `runs_of` takes them.
        unit: whose speed and voltage are drawn; None for the case's own choice.
        picture: the file to draw into.
        console: where the tables go.

    Raises:
        InputError: fewer than two runs, or too many; an unknown unit or format.
    """
    check_file(picture)
    runs = _several(references)
    names = named(runs)
    rows, settings = figures_of(runs), settings_that_differ(runs)
    drawn = unit_to_draw(runs, unit)
    table.show(console, names, rows, settings)
    draw(picture, runs, names, _system_and_unit(runs[0], drawn))
    console.print(f"plot  {shortest(picture)}", markup=False, highlight=False, soft_wrap=True)
    return {**table.as_data(names, rows, settings), "unit": drawn, "plot": str(picture)}


def plot(reference: str, patterns: Sequence[str], picture: Path, window_s: Window) -> Path:
    """Draw recorded quantities of a run, or of the runs of a sweep, and return the picture.

    Raises:
        InputError: no such result or quantity, an unknown format, or an empty window.
    """
    check_file(picture)
    first, last = window_s
    if first is not None and last is not None and first >= last:
        raise InputError(f"--from {first:g} must be before --to {last:g}")
    runs = runs_of([reference])
    draw(picture, runs, named(runs), chosen(runs, patterns), window_s)
    return picture


def unit_to_draw(runs: Sequence[Run], wanted: str | None) -> str:
    """Return the unit to draw: the one wanted, the case's own choice, or the first.

    Raises:
        InputError: the runs do not have it.
    """
    prefix = "speed_pu."
    units = [name.removeprefix(prefix) for name in recorded(runs[0]) if name.startswith(prefix)]
    unit = wanted or runs[0].told().get("plot_unit") or units[0]
    if unit not in units:
        raise InputError(
            f"--unit {unit}: the run has no such unit{near(unit, units)} (it has:"
            f" {', '.join(units)})"
        )
    return str(unit)


def _several(references: Sequence[str]) -> list[Run]:
    runs = runs_of(references)
    if len(runs) < 2:
        raise InputError("compare needs two runs or more: give another result, or a whole sweep")
    if len(runs) > MOST_RUNS:
        raise InputError(
            f"{len(runs)} runs are too many to stand side by side (at most {MOST_RUNS}): choose"
            " some as FOLDER:LABEL; points.csv of a sweep has a row for each of its points"
        )
    return runs


def _system_and_unit(run: Run, unit: str) -> list[Quantity]:
    nominal_hz = float(run.told()["frequency_hz"])
    return [
        Quantity("coi_pu", "Hz", "system frequency (centre of inertia)", nominal_hz),
        Quantity(f"speed_pu.{unit}", "Hz", f"speed of {unit}", nominal_hz),
        Quantity(f"vt_pu.{unit}", "pu", f"terminal voltage of {unit}"),
    ]
