"""The same code as plain NumPy."""

import os
import subprocess
import sys

import numpy as np
import pytest

from grid.runs import G26_AT_100_MS, disturbed
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
method, rate = sys.argv[1], int(sys.argv[2])
settings = GridSettings(
    steps_per_second=rate, events=[{"at": 0.1, "trip_generator": "G26"}]
)
events = plan_events(case, settings)
grid = Grid(system, method=method, steps_per_second=rate, events=events)
grid.advance(rate * 3 // 10)
sys.stdout.buffer.write(grid.x.tobytes())
"""


# The order of operations is the same; what differs is the last bit of sines and of fused array
# expressions, over 0.3 s with gains of 1e4 in them. The implicit method stops its iterations at
# 1e-9, with other last bits in its matrices.
@pytest.mark.parametrize(
    ("method", "rate", "tolerance"), [("rk4", 240, 1e-9), ("trapezoid", 60, 1e-8)]
)
def test_compiled_and_plain_numpy_give_the_same_trajectory(
    system: System, method: str, rate: int, tolerance: float
) -> None:
    """A kernel that the compiler alone understands cannot be checked by a reader."""
    environment = {**os.environ, "TIELINE_COMPILER": "off"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, method, str(rate)],
        env=environment,
        capture_output=True,
        check=True,
    )
    plain = np.frombuffer(done.stdout)
    grid = disturbed(system, method, rate, G26_AT_100_MS)
    grid.advance(rate * 3 // 10)
    np.testing.assert_allclose(plain, grid.x, rtol=0, atol=tolerance)
