"""Loops with delays for the tests: the scalar equation and the two-area case."""

from dataclasses import dataclass
from functools import cache
from math import pi

import numpy as np
from numpy.typing import NDArray

from tieline.grid.case import load_case
from tieline.grid.devices import with_pss
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.settings import PssSettings
from tieline.grid.system import build_system, sensor_average
from tieline.linear.delay import HIGHEST_HZ, DelayedLoop, delayed_eigenvalues
from tieline.linear.linearise import LinearSystem, linearise
from tieline.resources import case_folder

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

FASTEST = 2.0 * pi * HIGHEST_HZ
UNEQUAL = [0.0, 0.12, 0.45, 0.12]
"""Delays of the four PMUs of the two-area case, s: one without, two alike."""


@dataclass(frozen=True)
class GivenLoop:
    """A loop of given matrices."""

    A_without_average: Floats
    by_average: Floats
    average_rows: Floats
    average_weights: Floats


def scalar(a: float, members: int = 1) -> GivenLoop:
    """Return dx/dt = -a x(t - tau), or of the mean of signals with a delay each."""
    rows, weights = np.ones((members, 1)), np.full(members, 1.0 / members)
    return GivenLoop(np.zeros((1, 1)), np.array([-a]), rows, weights)


@cache
def two_area(gain: float = 18.0, beta1: float = 1.0, beta2: float = 0.0) -> LinearSystem:
    """Return the two-area case; by default its margin is finite: stable without delay."""
    case = load_case(case_folder("two_area"))
    tuned = with_pss(case, PssSettings(gain=gain, beta1=beta1, beta2=beta2))
    flow = solve_power_flow(case)
    # Unequal weights: equal ones would hide a sensor taken for another.
    average = sensor_average(np.array([1.0, 2.0, 3.0, 4.0]))
    return linearise(build_system(tuned, flow, case.base.sensors, average))


def inside(values: Complexes) -> Complexes:
    """Return the modes from 0.02 to 2.5 Hz that are not damped away within a cycle."""
    return values[(values.imag > 2.0 * pi * 0.02) & (np.abs(values) <= FASTEST)]


def distance(values: Complexes, from_values: Complexes) -> float:
    """Return the largest relative distance from any value to the nearest of others."""
    nearest = np.abs(values[:, None] - from_values).min(axis=1)
    return float((nearest / np.abs(values)).max())


def growing(linear: DelayedLoop, delay_s: float) -> int:
    """Return how many eigenvalues grow at a delay, by collocation."""
    return int((delayed_eigenvalues(linear, delay_s).real > 1e-5).sum())
