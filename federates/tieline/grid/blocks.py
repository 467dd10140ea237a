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
    places: list[list[int]] = [[] for _ in range(units)]
    groups = {int(x0): j for j, x0 in enumerate(jobs.x0) if jobs.n_states[j] > 0}
    for x0, j in sorted(groups.items()):
        of = jobs.units[jobs.units_at[j] : jobs.units_at[j + 1]]
        for row in range(jobs.n_states[j]):
            for column, unit in enumerate(of):
                places[unit].append(x0 + row * len(of) + column)
    places += [[sensors.x0 + k, sensors.x0 + count + k] for k in range(count)]
    if sorted(place for block in places for place in block) != list(range(states)):
        raise ValueError("a state belongs to no unit and no sensor, or to two")
    size = np.array([len(block) for block in places], np.int64)
    table = np.full((len(places), int(size.max())), EMPTY, np.int64)
    for b, block in enumerate(places):
        table[b, : len(block)] = block
    return Blocks(np.concatenate([plan.unit_bus, sensors.bus]), size, table, units)
