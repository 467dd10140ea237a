"""The trip of G26 as the grid's benchmarks run it, and the sizes of what a step computes."""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import time  # noqa: E402
from dataclasses import dataclass  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from tieline.grid.case import load_case  # noqa: E402
from tieline.grid.events import plan_events  # noqa: E402
from tieline.grid.powerflow import solve_power_flow  # noqa: E402
from tieline.grid.settings import GridSettings, PssSettings  # noqa: E402
from tieline.grid.simulation import Grid  # noqa: E402
from tieline.grid.stabilisers import with_pss  # noqa: E402
from tieline.grid.system import System, build_system  # noqa: E402
from tieline.grid.tile import tiled  # noqa: E402
from tieline.resources import case_folder  # noqa: E402

Floats = NDArray[np.float64]

ROWS_PER_SECOND = 60
SIGNALS = ("omega", "vt", "Efd", "v_s", "Pe", "Pm", "wbar")
TRIPPED = "G26"


def g26_system(tiles: int = 1) -> System:
    """Return the miniWECC, or tiles of it, with generalised stabilisers and 30 PMUs a tile."""
    case = load_case(case_folder("miniwecc"))
    case = tiled(case, tiles) if tiles > 1 else case
    case = with_pss(case, PssSettings(gain=9.0, beta1=1.0, beta2=0.5))
    return build_system(case, solve_power_flow(case), case.base.sensors)


def g26_grid(system: System, rate: int, at_s: float = 1.0, method: str = "rk4") -> Grid:
    """Return the grid at rest with the trip of G26 ahead of it."""
    event = {"at": at_s, "trip_generator": TRIPPED}
    settings = GridSettings.model_validate(
        {"duration": 60.0, "method": method, "steps_per_second": rate, "events": [event]}
    )
    events = plan_events(system.case, settings)
    return Grid(system, method=method, steps_per_second=rate, events=events)


@dataclass(frozen=True)
class Ran:
    """A simulation: CPU seconds of the calling process, rows recorded (rows, values)."""

    cpu_s: float
    rows: Floats


def simulate(system: System, seconds: int, rate: int, method: str = "rk4") -> Ran:
    """Return a run with all that an experiment records of the grid, kept in memory.

    The time is that of integration and recording; the system at rest is ready before.
    """
    grid, blocks = g26_grid(system, rate, method=method), []
    scale = np.ones((len(SIGNALS), len(system.case.units)))
    per_row = rate // ROWS_PER_SECOND
    grid.record(per_row, SIGNALS, scale, ROWS_PER_SECOND, lambda rows: blocks.append(rows.copy()))
    began = time.process_time()
    grid.advance(seconds * rate)
    grid.record_now()
    rows = np.concatenate(blocks)
    return Ran(time.process_time() - began, rows)


def speeds(system: System, rows: Floats) -> Floats:
    """Return (rows, units) the speeds of all units but the tripped one, which runs away alone."""
    units = system.case.units
    return rows[:, 2 : 2 + len(units)][:, [unit != TRIPPED for unit in units]]
