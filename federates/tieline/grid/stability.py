"""When a run is over: speeds, angles or voltages that no interconnection comes back from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tieline.grid.case import Case

Floats = NDArray[np.float64]

SPEED_PU = (0.9, 1.1)
"""Range of speeds that the models hold in; a unit outside it is long disconnected in practice."""
ANGLE_RAD = np.pi
"""A rotor this far from the centre of inertia has lost synchronism."""


@dataclass(frozen=True)
class Ending:
    """Why a run ended before its time, as a result and not as a failure."""

    tick: int
    text: str


def lost(case: Case, tick: int, omega: Floats, delta: Floats, weight: Floats) -> Ending | None:
    """Return why a run is over, or None while it is not.

    Args:
        case: names the units.
        tick: now.
        omega, delta: (units,) speeds in pu and angles in rad.
        weight: (units,) inertia of the units in service, 0 for the others.
    """
    running = weight > 0
    if not running.any():
        return None
    fast = running & ((omega < SPEED_PU[0]) | (omega > SPEED_PU[1]))
    for unit in np.flatnonzero(fast):
        text = f"unstable: speed of {case.units[unit]} {omega[unit]:.4f} pu, outside {SPEED_PU}"
        return Ending(tick, text)
    centre = (weight * delta).sum() / weight.sum()
    away = np.where(running, np.abs(delta - centre), 0.0)
    if away.max() > ANGLE_RAD:
        unit = np.argmax(away)
        degrees = np.rad2deg(away[unit])
        where = f"{degrees:.0f} degrees from the centre of inertia"
        return Ending(tick, f"unstable: {case.units[unit]} lost synchronism, {where}")
    return None
