"""The weights of wbar: of rotors or sensors, equal, given, or by stored energy.

With `H` or `H_MVA` every unit in service carries its inertia constant, or that times its rating
(its stored energy). A rotor has the weight of its unit. A sensor has the sum over the units next to
it: a unit belongs to the sensor at its own bus or else to the one at the far end of its step-up
branch.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.devices import groups
from tieline.grid.models.base import Machine
from tieline.grid.plan import Average
from tieline.grid.system import rotor_average, sensor_average
from tieline.wams.settings import WamsSettings

Floats = NDArray[np.float64]


def inertia(case: Case) -> Floats:
    """Return (units,) inertia constants H, s on the machine base; 0 for none."""
    H = np.zeros(len(case.units))
    for group in groups(case, {}):
        if issubclass(group.model, Machine):
            H[group.units] = group.model.inertia(group.p)
    return H


def rotor_weights(case: Case, weights: str | Sequence[float]) -> Floats:
    """Return (units,) the weight of each rotor, not scaled; 0 for a machine without inertia.

    Raises:
        InputError: a list has not one weight a unit.
    """
    H = inertia(case)
    if not isinstance(weights, str):
        if len(weights) != len(case.units):
            raise InputError(
                f"wams.weights must have one weight for each of the {len(case.units)} units, as "
                f"grid.pss.average is rotors (got {len(weights)})"
            )
        return np.asarray(weights, np.float64)
    if weights == "equal":
        return (H > 0).astype(np.float64)
    return H * case.unit_MVA if weights == "H_MVA" else H


def sensor_shares(case: Case, sensors: Sequence[int], weights: str) -> Floats:
    """Return (sensors, units) what each unit adds to the weight of each sensor, not scaled.

    Args:
        case: the case.
        sensors: bus numbers with a PMU.
        weights: `H` or `H_MVA`.

    Raises:
        InputError: a sensor has no unit next to it.
    """
    shares = np.zeros((len(sensors), len(case.units)))
    energy = rotor_weights(case, weights)
    row_of = {case.bus_index(number): row for row, number in enumerate(sensors)}
    for unit, bus in enumerate(case.unit_bus.tolist()):
        for near in (bus, _far_end(case, bus)):
            if near in row_of:
                shares[row_of[near], unit] = energy[unit]
                break
    findings = [
        f"wams.weights: {weights} weighs a sensor by the units next to it, but bus {number} has "
        "none; take it out of wams.sensors or give the weights as a list"
        for number, share in zip(sensors, shares, strict=True)
        if not share.any()
    ]
    if findings:
        raise InputError(findings)
    return shares


def sensor_weights(case: Case, sensors: Sequence[int], weights: str | Sequence[float]) -> Floats:
    """Return (sensors,) the weight of each sensor with every unit in service, not scaled.

    Raises:
        InputError: a list has not one weight a sensor, or a sensor that has to be weighed by its
            units has none.
    """
    if not isinstance(weights, str):
        if len(weights) != len(sensors):
            raise InputError(
                f"wams.weights must have one weight for each of the {len(sensors)} sensors"
                f" (got {len(weights)})"
            )
        return np.asarray(weights, np.float64)
    if weights == "equal":
        return np.ones(len(sensors))
    return sensor_shares(case, sensors, weights).sum(axis=1)


def continuous_average(
    case: Case, sensors: Sequence[int], wams: WamsSettings, of: str, delay_steps: int
) -> Average:
    """Return the average that is formed at every step, `delay_steps` late.

    Args:
        case: the case.
        sensors: bus numbers with a PMU.
        wams: how members are weighed.
        of: the members, `sensors` or `rotors`.
        delay_steps: whole steps of delay.

    Raises:
        InputError: the weights do not fit the members.
    """
    if of == "rotors":
        return rotor_average(rotor_weights(case, wams.weights), delay_steps)
    average = sensor_average(sensor_weights(case, sensors, wams.weights), delay_steps)
    if isinstance(wams.weights, str) and wams.weights != "equal":
        return average._replace(share=sensor_shares(case, sensors, wams.weights))
    return average


def without_tripped(average: Average, is_in_service: NDArray[np.bool_]) -> Average:
    """Return the average of the units in service.

    A tripped unit takes its share with it. A sensor goes on measuring the bus that it stands at,
    so with equal or given weights all of them stay.
    """
    if not average.share.size:
        return average
    weight = average.share @ is_in_service.astype(np.float64)
    return average._replace(weight=weight / weight.sum()) if weight.any() else average


def _far_end(case: Case, bus: int) -> int:
    """Return the bus at the far end of the branch of least impedance at a bus."""
    branches = case.branches
    here = np.flatnonzero((branches.start == bus) | (branches.end == bus))
    nearest = here[np.argmin(np.abs(branches.impedance[here]))]
    return int(branches.start[nearest] + branches.end[nearest] - bus)
