"""The time-varying damping coefficient along a trajectory.

The swing equation 2H dw/dt = (Pm - Pe) / w - D (w - w0), linearised about a moving trajectory
instead of a resting point, has the damping coefficient

    D(t) = D + (Pm(t) - Pe(t)) / w(t)^2

so that a unit that is being accelerated is damped more, one that is braked less. Source: Elliott,
Arabshahi and Kirschen, A Generalized PSS Architecture for Balancing Transient and Small-Signal
Response, section II.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.experiment.results import Run, read_runs
from tieline.grid.case import load_case
from tieline.grid.devices import groups
from tieline.grid.models.base import Machine
from tieline.grid.tables import near

Floats = NDArray[np.float64]


def damping_coefficients(
    folder: Path, units: Sequence[str] = ()
) -> tuple[Floats, dict[str, Floats]]:
    """Return the instants (t,) of a result, s, and D(t) (t,) of units, pu on each machine's base.

    Args:
        folder: a result folder of one run, or a run's folder within a sweep.
        units: their names; the five that vary most without any, units that trip left out.

    Raises:
        InputError: the folder is no result of one run, or there is no such unit.
    """
    runs = read_runs(folder)
    if len(runs) != 1:
        raise InputError(f"{folder} holds {len(runs)} runs: give the folder of one")
    run = runs[0]
    case = load_case(Path(run.told()["case"]))
    for unit in units:
        if unit not in case.units:
            raise InputError(f"no unit '{unit}'{near(unit, list(case.units))}")
    own = np.zeros(len(case.units))
    for group in groups(case, {}):
        symbols = [parameter.symbol for parameter in group.model.parameters]
        if issubclass(group.model, Machine) and "D" in symbols:
            own[group.units] = group.p[symbols.index("D")]
    chosen = list(units) or [unit for unit in case.units if unit not in run.tripped_units()]
    to_machine = dict(zip(case.units, case.base.base_MVA / case.unit_MVA, strict=True))
    time_s, found = _read(run, chosen, to_machine, dict(zip(case.units, own, strict=True)))
    if not units:
        most = sorted(found, key=lambda unit: -float(np.ptp(found[unit])))[:5]
        found = {unit: found[unit] for unit in case.units if unit in most}
    return time_s, found


def _read(
    run: Run, units: Sequence[str], to_machine: dict[str, float], own: dict[str, float]
) -> tuple[Floats, dict[str, Floats]]:
    columns = [f"{name}.{unit}" for unit in units for name in ("Pm_pu", "Pe_pu", "speed_pu")]
    table = run.table("grid", "t_s", *columns)
    found = {}
    for unit in units:
        Pm, Pe, w = (
            table[f"{name}.{unit}"].to_numpy(np.float64) for name in ("Pm_pu", "Pe_pu", "speed_pu")
        )
        # Pe is recorded on the system base, Pm on the machine's.
        found[unit] = own[unit] + (Pm - Pe * to_machine[unit]) / w**2
    return table["t_s"].to_numpy(np.float64), found
