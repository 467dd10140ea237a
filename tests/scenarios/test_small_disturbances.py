"""One mode three ways: eigenvalue, trajectory of a small disturbance, ring-down estimate of it.

The disturbance is the mode itself, a ten-thousandth of a per unit large, so that it rings down
alone; with a late average the rest of its history is missing, which stirs up a little of others.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tieline.experiment.ringdown import ring_down
from tieline.grid.simulation import Grid
from tieline.grid.system import System
from tieline.linear import Study, linearise
from tieline.linear.delay import refined_mode
from tieline.linear.linearise import LinearSystem
from tieline.linear.modes import Modes, modes_of

SIZE = 1e-4
RATE, SAMPLE_TICKS = 240, 12
DELAY_S = 0.25
PERIODS = 5.0

STUDIES = {
    # Chosen so that three modes ring for five periods and more.
    "two_area": (Study("two_area", gain=6, beta1=1.0, beta2=0.2), (0.75, 1.5, 1.52)),
    "miniwecc": (Study("miniwecc", gain=9, beta1=1.0, beta2=0.5), (0.366, 0.533, 0.62)),
}


@cache
def analysed(name: str) -> tuple[System, LinearSystem, Modes]:
    system = STUDIES[name][0].system()
    linear = linearise(system)
    return system, linear, modes_of(linear)


def rung(system: System, vector: np.ndarray, delay_s: float, duration_s: float) -> np.ndarray:
    """Return the speeds (instants, units), pu, after a start along a mode."""
    speeds = np.abs(vector[system.plan.average.omega])
    start = system.x0 + SIZE * (vector / speeds.max()).real
    average = system.plan.average._replace(delay_steps=round(delay_s * RATE))
    plan = system.plan._replace(average=average)
    grid = Grid(replace(system, x0=start, plan=plan), method="rk4", steps_per_second=RATE)
    rows = []
    for tick in range(0, round(duration_s * RATE) + 1, SAMPLE_TICKS):
        grid.advance(tick)
        rows.append(grid.x[average.omega])
    return np.array(rows)


@pytest.mark.parametrize("delay_s", [0.0, DELAY_S])
@pytest.mark.parametrize("at", [0, 1, 2])
@pytest.mark.parametrize("name", list(STUDIES))
def test_eigenvalue_trajectory_and_ring_down_agree(name: str, at: int, delay_s: float) -> None:
    """Frequency within 1 %, damping ratio within 0.005."""
    system, linear, modes = analysed(name)
    candidates = modes.of_kind("inter-area", "local")
    f = STUDIES[name][1][at]
    taken = candidates[np.argsort(np.abs(modes.frequency_hz[candidates] - f))]
    place = int(taken[1] if name == "two_area" and at == 2 else taken[0])
    eigenvalue, vector = complex(modes.eigenvalues[place]), modes.right[:, place]
    if delay_s:
        late = refined_mode(linear, eigenvalue, delay_s)
        eigenvalue, vector = late.eigenvalue, late.vector
    f_hz, ratio = eigenvalue.imag / (2 * np.pi), -eigenvalue.real / abs(eigenvalue)
    speeds = rung(system, vector, delay_s, delay_s + PERIODS / f_hz)
    shape = vector[system.plan.average.omega]
    first, last = np.argmax(shape.real), np.argmin(shape.real)
    swing = speeds[:, first] - speeds[:, last]
    skipped = round(delay_s * RATE / SAMPLE_TICKS)
    found = ring_down(swing[skipped:], SAMPLE_TICKS / RATE, (0.75 * f_hz, 1.5 * f_hz)).mode
    assert found is not None
    assert found.frequency_hz == pytest.approx(f_hz, rel=0.01)
    assert found.damping_ratio == pytest.approx(ratio, abs=0.005)
