"""The wide-area average between the steps: what was delivered and when, and what it was before."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_in_place

Floats = NDArray[np.float64]

HISTORY_MARGIN = 4
"""Instants that the history of a delayed average holds beyond its delay."""


class Averages(NamedTuple):
    """What stabilisers know of wbar besides the present states.

    Attributes:
        past: ring of past averages, indexed by tick; holds the delay and a margin.
        due: (m,) ascending ticks from which the averages `told` are believed.
        told: (m, units) those averages, pu.
    """

    past: Floats
    due: NDArray[np.int64]
    told: Floats


def no_averages(delay_steps: int, units: int) -> Averages:
    """Return a system's averages at rest, when nothing was told yet."""
    past = np.ones(delay_steps + HISTORY_MARGIN)
    return Averages(past, np.empty(0, np.int64), np.empty((0, units)))


@compiled_in_place
def hear(averages: Averages, tick: int, believed: Floats) -> None:
    """Write what is due at a tick into the averages (units,) that are believed."""
    for i in range(len(averages.due)):
        if averages.due[i] == tick:
            for unit in range(len(believed)):
                believed[unit] = averages.told[i, unit]


@compiled_in_place
def late_average(past: Floats, tick: int, delay: int, half: int) -> float:
    """Return the average `delay` steps before `tick` (plus `half` half steps).

    Between two steps it is the cubic through the four nearest instants, of the same order as RK4.
    """
    size = len(past)
    at = tick - delay
    if half == 0:
        return past[at % size]
    if half == 2:
        return past[(at + 1) % size]
    inner = past[at % size] + past[(at + 1) % size]
    outer = past[(at - 1) % size] + past[(at + 2) % size]
    return (9.0 * inner - outer) / 16.0
