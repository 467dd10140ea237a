"""The same code as plain NumPy."""

import os
import subprocess
import sys

import numpy as np

from tieline.grid.case import Case
from tieline.grid.events import plan_events
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import System

SCRIPT = """
import sys
import numpy as np
from tieline import compiled
from tieline.grid.case import load_case
from tieline.grid.devices import with_pss
from tieline.grid.events import plan_events
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.settings import GridSettings, PssSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import build_system
from tieline.resources import case_folder

assert not compiled.IS_ON
case = load_case(case_folder("miniwecc"))
case = with_pss(case, PssSettings(gain=9.0, beta1=1.0, beta2=0.5))
system = build_system(case, solve_power_flow(case), case.base.sensors)
events = plan_events(case, GridSettings(events=[{"at": 0.1, "trip_generator": "G26"}]))
grid = Grid(system, method="rk4", steps_per_second=240, events=events)
grid.advance(72)
sys.stdout.buffer.write(grid.x.tobytes())
"""


def test_compiled_and_plain_numpy_give_the_same_trajectory(system: System, tuned: Case) -> None:
    """A kernel that the compiler alone understands cannot be checked by a reader."""
    environment = {**os.environ, "TIELINE_COMPILER": "off"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, check=True
    )
    plain = np.frombuffer(done.stdout)
    events = plan_events(tuned, GridSettings(events=[{"at": 0.1, "trip_generator": "G26"}]))
    grid = Grid(system, method="rk4", steps_per_second=240, events=events)
    grid.advance(72)
    # The order of operations is the same; what differs is the last bit of sines and of fused
    # array expressions, over 72 steps with gains of 1e4 in them.
    np.testing.assert_allclose(plain, grid.x, rtol=0, atol=1e-9)
