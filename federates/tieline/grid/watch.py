"""What is looked at while the grid moves: rows to record, and whether a unit is lost."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_in_place
from tieline.grid.plan import Work
from tieline.grid.sensors import Sensors
from tieline.grid.stability import ANGLE_RAD, SPEED_PU

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SLOWEST, FASTEST = SPEED_PU


class Watch(NamedTuple):
    """What the integration looks at on its way.

    A row is the time in s, the speed of the centre of inertia, each quantity of every unit, the
    frequency of each PMU and the voltage magnitude of each bus.

    Attributes:
        per_look: ticks between two looks at speeds and angles.
        omega, delta: (units,) places in x; weight: (units,) inertia of units in service, else 0.
        per_row: ticks between two rows; 0 for none.
        steps_per_second: ticks of a second.
        quantity: (quantities,) rows of signals; scale: (quantities, units) their factors.
        rows: (capacity, values); noted: (2,) rows filled, and the tick of the last one.
    """

    per_look: int
    omega: Integers
    delta: Integers
    weight: Floats
    per_row: int
    steps_per_second: int
    quantity: Integers
    scale: Floats
    rows: Floats
    noted: Integers


@compiled_in_place
def centre_of_inertia(watch: Watch, x: Floats) -> float:
    """Return the speed of the units in service, weighted by stored energy, pu.

    A unit without inertia is left out, and with no other in service the speed is 1.
    """
    total, deviation = 0.0, 0.0
    for i in range(len(watch.weight)):
        total += watch.weight[i]
        deviation += watch.weight[i] * (x[watch.omega[i]] - 1.0)
    return 1.0 + deviation / total if total > 0.0 else 1.0


@compiled_in_place
def has_lost(watch: Watch, x: Floats, tick: int) -> bool:
    """Return whether a unit in service is lost at `tick`, as `stability.lost` says; if looked."""
    if tick % watch.per_look != 0:
        return False
    total, centre = 0.0, 0.0
    for i in range(len(watch.weight)):
        total += watch.weight[i]
        centre += watch.weight[i] * x[watch.delta[i]]
    for i in range(len(watch.weight)):
        if watch.weight[i] > 0.0:
            speed, away = x[watch.omega[i]], abs(x[watch.delta[i]] - centre / total)
            if not (SLOWEST <= speed <= FASTEST and away <= ANGLE_RAD):
                return True
    return False


@compiled_in_place
def write_row(watch: Watch, sensors: Sensors, work: Work, x: Floats, tick: int) -> None:
    """Add the row of a tick whose signals and voltages stand in `work`."""
    row = watch.rows[watch.noted[0]]
    row[0] = tick / watch.steps_per_second
    row[1] = centre_of_inertia(watch, x)
    at = 2
    for i in range(len(watch.quantity)):
        for unit in range(len(watch.weight)):
            row[at + unit] = watch.scale[i, unit] * work.signals[watch.quantity[i], unit]
        at += len(watch.weight)
    z2 = sensors.x0 + len(sensors.bus)
    for k in range(sensors.pmus):
        row[at + k] = sensors.f0_Hz + x[z2 + k] / (2.0 * np.pi)
    at += sensors.pmus
    for bus in range(len(work.v)):
        row[at + bus] = abs(work.v[bus])
    watch.noted[0] += 1
    watch.noted[1] = tick


@compiled_in_place
def note(watch: Watch, sensors: Sensors, work: Work, x: Floats, tick: int) -> None:
    """Add the row of a tick if one is due, once."""
    if watch.per_row > 0 and tick % watch.per_row == 0 and tick > watch.noted[1]:
        write_row(watch, sensors, work, x, tick)
