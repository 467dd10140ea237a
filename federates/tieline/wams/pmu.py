"""Phasor measurement units: what they measure, as data frames."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tieline.c37118.batch import checked_idcodes, encode_frames
from tieline.c37118.constants import StatBit

_SQRT3 = math.sqrt(3.0)


class PmuReporter:
    """Writes the frames of n PMUs that measure at one instant.

    Each frame carries the bus's positive-sequence voltage, line-to-neutral, in volts RMS and
    rectangular coordinates; its angle is that of the grid model's rotating frame. FREQ and DFREQ
    come from the PMU's own filter, whose states the grid integrates.

    Args:
        idcodes: (n,) stream numbers, 1 to 65534.
        base_v: (n,) base voltages of the buses, line-to-line, V.
        epoch_s: SOC of the start of the run, s since 1970-01-01 UTC.

    Raises:
        InputError: stream numbers are equal or out of range.
    """

    def __init__(self, idcodes: ArrayLike, base_v: ArrayLike, epoch_s: int = 0) -> None:
        self._idcodes = checked_idcodes(idcodes)
        self._neutral_v = np.asarray(base_v, np.float64) / _SQRT3
        self._epoch_s = epoch_s

    def frames(
        self,
        measured_ns: int,
        v: NDArray[np.complex128],
        f_hz: NDArray[np.float64],
        rocof_hz_s: NDArray[np.float64],
        is_live: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.uint8]:
        """Return the frames (n, 34).

        Args:
            measured_ns: instant of the measurement, ns since the start of the run.
            v: (n,) bus voltages, pu.
            f_hz: (n,) frequencies, Hz.
            rocof_hz_s: (n,) rates of change of frequency, Hz/s.
            is_live: (n,) False where the bus is dead: its STAT says that the data are no good.
        """
        stat = 0 if is_live is None else np.where(is_live, 0, int(StatBit.DATA_ERROR))
        return encode_frames(
            self._idcodes,
            measured_ns,
            v * self._neutral_v,
            f_hz,
            rocof_hz_s,
            epoch_s=self._epoch_s,
            stat=stat,
        )
