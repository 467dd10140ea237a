"""The system cut into blocks: a unit with its controls, or a sensor, each at one bus.

A block meets the rest through the voltage of its bus and, slowly, through wbar; what a unit gives
back is the voltage E'' behind its impedance. An implicit method solves such a system block by
block, with the network as the one thing that joins them (Kundur, Power System Stability and
Control, 1994, section 13.3.5).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.grid.plan import Plan

Integers = NDArray[np.int64]

EMPTY = -1
"""Fills the rows of `Blocks.place` beyond a block's size."""


class Blocks(NamedTuple):
    """The units in the order of their signals, then the sensors.

    Attributes:
        bus: (blocks,) bus index; size: (blocks,) number of states.
        place: (blocks, largest size) places of a block's states in x, then `EMPTY`.
        units: how many of the blocks are units.
    """

    bus: Integers
    size: Integers
    place: Integers
    units: int


def cut(plan: Plan, states: int) -> Blocks:
    """Return the blocks of a system of `states` states.

    Raises:
        ValueError: a state belongs to none of them, or to two.
    """
    jobs, sensors = plan.jobs, plan.sensors
    units, count = len(plan.unit_bus), len(sensors.bus)
    groups = {int(x0): j for j, x0 in enumerate(jobs.x0) if jobs.n_states[j] > 0}
    held = [
        (x0, int(jobs.n_states[j]), jobs.units[jobs.units_at[j] : jobs.units_at[j + 1]])
        for x0, j in sorted(groups.items())
    ]
    size = np.full(units + count, 2, np.int64)
    size[:units] = 0
    for _, states_each, of in held:
        size[of] += states_each
    place = np.full((len(size), int(size.max())), EMPTY, np.int64)
    filled = np.zeros(units, np.int64)
    for x0, states_each, of in held:
        rows = np.arange(states_each)
        place[of[:, None], filled[of, None] + rows] = (
            x0 + rows * len(of) + np.arange(len(of))[:, None]
        )
        filled[of] += states_each
    place[units:, :2] = sensors.x0 + np.arange(count)[:, None] + count * np.arange(2)
    if not np.array_equal(np.sort(place[place != EMPTY]), np.arange(states)):
        raise ValueError("a state belongs to no unit and no sensor, or to two")
    return Blocks(np.concatenate([plan.unit_bus, sensors.bus]), size, place, units)
