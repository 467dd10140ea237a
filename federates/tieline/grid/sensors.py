"""The PMUs' frequency estimator: a derivative filter on the angle of a bus voltage.

    theta ->[ b s / (s^2 + a1 s + b) ]-> 2 pi (f - f0)

Realised with z1' = z2 and z2' = b (theta - z1) - a1 z2, whose z2 is the output. As only
theta - z1 enters, wrapping it to (-pi, pi] unwraps the bus angle without memory, as long as it is
smaller: z1 lags by a1/b = 0.1 s, so up to 4.8 Hz off nominal. Beyond, at the terminal of a unit
that runs away alone, the estimate slips cycles and means nothing.
Loads that answer to frequency see it through the same filter, at their own bus.
Source: the miniWECC's frequency sensors (PSTess 1.1, by R. Elliott).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_in_place

Floats = NDArray[np.float64]

A1 = 28.8394098913241
B = 277.237187626600

DEAD_PU = 1e-6
"""Voltage below which a bus counts as dead."""


class Sensors(NamedTuple):
    """The filters on bus angles: those of the PMUs, then those of loads that see frequency.

    Attributes:
        bus: (m,) bus index of each; x0: place of their states (2, m) in x.
        f0_Hz: system frequency.
        pmus: how many of them are PMUs.
    """

    bus: NDArray[np.int64]
    x0: int
    f0_Hz: float
    pmus: int


@compiled_in_place
def filter_angles(sensors: Sensors, v: NDArray[np.complex128], x: Floats, dx: Floats) -> None:
    """Write the derivatives of the filters' states (2, m) from the bus voltages."""
    count = len(sensors.bus)
    for k in range(count):
        z1, z2 = sensors.x0 + k, sensors.x0 + count + k
        phasor = v[sensors.bus[k]]
        gap = np.arctan2(phasor.imag, phasor.real) - x[z1]
        gap = gap - 2.0 * np.pi * np.floor(gap / (2.0 * np.pi) + 0.5)
        if not np.abs(phasor.real) + np.abs(phasor.imag) > DEAD_PU:
            # A dead bus has no angle: its estimate runs down to the nominal frequency.
            gap = 0.0
        dx[z1] = x[z2]
        dx[z2] = B * gap - A1 * x[z2]


def frequencies(sensors: Sensors, x: Floats) -> Floats:
    """Return (pmus,) the frequencies that the PMUs show, Hz."""
    first = sensors.x0 + len(sensors.bus)
    return sensors.f0_Hz + x[first : first + sensors.pmus] / (2.0 * np.pi)
