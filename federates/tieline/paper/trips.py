"""What items on trips share: runs read as arrays, the author's toolbox beside them, figures."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tieline.experiment.results import Run
from tieline.figures import colours
from tieline.resources import case_folder
from tieline.tables import read_table

Floats = NDArray[np.float64]

NOMINAL_HZ = 60.0
RECORDED_HZ = 60
EVENT_S = 1.0


def time_of(run: Run) -> Floats:
    """Return (t,) the recorded instants, s."""
    return run.table("grid", "t_s")["t_s"].to_numpy(np.float64)


def frequency_of(run: Run) -> Floats:
    """Return (t,) the frequency of the centre of inertia, Hz."""
    return NOMINAL_HZ * run.table("grid", "coi_pu")["coi_pu"].to_numpy(np.float64)


def nadir_of(run: Run) -> float:
    """Return the lowest frequency of the centre of inertia after the event, Hz."""
    return float(run.summary()["frequency"]["nadir_hz"])


def damping_of(run: Run) -> float:
    """Return the damping ratio of the tie swing, NaN where none stands out."""
    found = run.summary()["swing"]["damping_ratio"]
    return float("nan") if found is None else float(found)


def voltage_of(run: Run, unit: str) -> Floats:
    """Return (t,) the terminal voltage of a unit, pu."""
    return run.table("grid", f"vt_pu.{unit}")[f"vt_pu.{unit}"].to_numpy(np.float64)


def speeds_of(run: Run) -> Floats:
    """Return (t, units) the speeds of the units that stay, pu."""
    lost = {f"speed_pu.{unit}" for unit in run.tripped_units()}
    names = [n for n in run.columns("grid") if n.startswith("speed_pu.") and n not in lost]
    return run.table("grid", *names)[names].to_numpy(np.float64)


def far_apart(one: Run, other: Run) -> float:
    """Return the largest difference of a speed between two runs, pu, while both go on."""
    first, second = speeds_of(one), speeds_of(other)
    rows = min(len(first), len(second))
    return float(np.abs(first[:rows] - second[:rows]).max())


def from_reference(run: Run, path: Path) -> float:
    """Return the largest difference of a speed from a table of the author's toolbox, pu."""
    expected = read_table(path)
    time_s = time_of(run)
    expected = expected[expected["t_s"] <= time_s[-1] + 1e-9]
    rows = np.rint(expected["t_s"].to_numpy() * RECORDED_HZ).astype(int)
    lost = {f"speed_pu.{unit}" for unit in run.tripped_units()}
    names = [n for n in expected.columns if n.startswith("speed_pu.") and n not in lost]
    found = run.table("grid", *names)[names].to_numpy(np.float64)[rows]
    return float(np.abs(found - expected[names].to_numpy(np.float64)).max())


def expected_folder(case: str, trip: str) -> Path:
    """Return the folder of the author's toolbox's runs of a trip."""
    return case_folder(case) / "expected" / trip


def expected_nadirs(case: str, trip: str) -> dict[str, float]:
    """Return the nadirs that the author's toolbox found, Hz, by the name of the run."""
    with (expected_folder(case, trip) / "runs.csv").open(encoding="utf-8", newline="") as file:
        return {row["run"]: float(row["coi_nadir_Hz"]) for row in csv.DictReader(file)}


def trip_figure(runs: Mapping[str, Run], unit: str, title: str) -> Figure:
    """Return frequency and one unit's terminal voltage against time, one curve a run."""
    figure = Figure(figsize=(6.3, 5.2), layout="constrained")
    speed, voltage = figure.subplots(2, 1, sharex=True)
    for (label, run), colour in zip(runs.items(), colours(len(runs)), strict=True):
        time_s = time_of(run)
        speed.plot(time_s, frequency_of(run), color=colour, label=label)
        voltage.plot(time_s, voltage_of(run, unit), color=colour)
    speed.set_ylabel("system frequency, Hz")
    voltage.set_ylabel(f"terminal voltage of {unit}, pu")
    speed.legend(title=title, title_fontsize=8.0, ncols=2)
    finish(voltage)
    for axes in (speed, voltage):
        axes.ticklabel_format(useOffset=False)
        axes.axvline(EVENT_S, color="0.6", linewidth=0.8, linestyle=":")
    return figure


def finish(axes: Axes) -> None:
    """Put time under a panel."""
    axes.set_xlabel("time, s")
    axes.margins(x=0)
