"""What each controller believes the centre-of-inertia speed to be, from the frames it got."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tieline.c37118.batch import Verdict, checked_idcodes, read_frames
from tieline.compiled import compiled_in_place
from tieline.errors import CosimError, InputError
from tieline.units import NS_PER_S

_NEVER = np.iinfo(np.int64).min
_UNKNOWN = -1
_IDCODES = 1 << 16
_TAG_ROUNDING_NS = 500
"""Time tags are whole microseconds, rounded."""


class Fate(IntEnum):
    """What became of a delivered frame."""

    ACCEPTED = 0
    LATE = 1
    DUPLICATE = 2
    BAD_SIZE = 3
    BAD_SYNC = 4
    BAD_CRC = 5
    DATA_ERROR = 6
    NO_FREQUENCY = 7
    UNKNOWN_IDCODE = 8


_ACCEPTED, _LATE, _DUPLICATE = int(Fate.ACCEPTED), int(Fate.LATE), int(Fate.DUPLICATE)

_FATE_OF_VERDICT = np.zeros(len(Verdict), np.uint8)
_FATE_OF_VERDICT[Verdict.SIZE] = Fate.BAD_SIZE
_FATE_OF_VERDICT[Verdict.SYNC] = Fate.BAD_SYNC
_FATE_OF_VERDICT[Verdict.CRC] = Fate.BAD_CRC
_FATE_OF_VERDICT[Verdict.DATA_ERROR] = Fate.DATA_ERROR
_FATE_OF_VERDICT[Verdict.NO_FREQUENCY] = Fate.NO_FREQUENCY


@dataclass(frozen=True)
class Readings:
    """What m frames say.

    Attributes:
        fates: (m,) uint8, `Fate.ACCEPTED` or why the frame is refused.
        sensors: (m,) index of the sensor.
        tags_ns: (m,) time tag, ns since the start of the run.
        f_hz: (m,) frequency, Hz.
    """

    fates: NDArray[np.uint8]
    sensors: NDArray[np.int32]
    tags_ns: NDArray[np.int64]
    f_hz: NDArray[np.float64]

    def first_early(
        self, payload_row: NDArray[np.int64], arrivals_ns: NDArray[np.int64]
    ) -> int | None:
        """Return the first delivery (of r) whose sound frame says that it was measured later.

        Args:
            payload_row: (r,) which frame each brings.
            arrivals_ns: (r,) when it came.
        """
        place = int(_first_early(payload_row, arrivals_ns, self.fates, self.tags_ns))
        return None if place < 0 else place


def checked_weights(weights: ArrayLike | None, n_sensors: int) -> NDArray[np.float64]:
    """Return the weights (n_sensors,) of the sensors, scaled to sum 1; all equal for None.

    Raises:
        InputError: their number is wrong, or one is negative or not finite, or all are zero.
    """
    if weights is None:
        return np.full(n_sensors, 1.0 / n_sensors)
    alpha = np.asarray(weights, np.float64)
    if alpha.shape != (n_sensors,):
        raise InputError(
            f"wams.weights: {n_sensors} sensors need as many weights (got {alpha.size})"
        )
    findings = [
        f"wams.weights[{k}] must be finite and at least 0 (got {value})"
        for k, value in enumerate(alpha)
        if not (np.isfinite(value) and value >= 0.0)
    ]
    if not findings and not alpha.any():
        findings = ["wams.weights must not all be 0"]
    if findings:
        raise InputError(findings)
    return alpha / alpha.sum()


class WideAreaAverage:
    """The newest sound frame of each sensor at each controller, and the average made of them.

        wbar = (1/f0) * sum_k alpha_k f_k,    alpha_k >= 0,  sum alpha_k = 1

    A controller keeps a sensor's frame until one with a newer time tag arrives; before the first
    one it takes f0. A frame that is not sound, or whose STAT says that its values must not be used,
    is refused and counted.

    Args:
        n_controllers: number of controllers.
        idcodes: (n_sensors,) stream number of each sensor.
        weights: (n_sensors,) weights alpha, scaled to sum 1; all equal for None.
        f0_hz: nominal frequency, Hz.
        epoch_s: SOC of the start of the run, s since 1970-01-01 UTC.

    Raises:
        InputError: stream numbers are none, equal or out of range, or the weights make no average.
    """

    def __init__(
        self,
        n_controllers: int,
        idcodes: ArrayLike,
        weights: ArrayLike | None = None,
        f0_hz: float = 60.0,
        epoch_s: int = 0,
    ) -> None:
        numbers = checked_idcodes(idcodes)
        n_sensors = len(numbers)
        self._sensor_of = np.full(_IDCODES, _UNKNOWN, np.int32)
        self._sensor_of[numbers] = np.arange(n_sensors, dtype=np.int32)
        self._alpha = checked_weights(weights, n_sensors)
        self._f0_hz = f0_hz
        self._epoch_s = epoch_s
        self._f_hz = np.full((n_controllers, n_sensors), f0_hz)
        self._tag_ns = np.full((n_controllers, n_sensors), _NEVER, np.int64)
        self._counts = np.zeros((n_controllers, len(Fate)), np.int64)

    def deliver(
        self,
        payloads: NDArray[np.uint8],
        destination: NDArray[np.integer],
        payload_row: NDArray[np.integer],
    ) -> None:
        """Hand frames to controllers, in the order given.

        Args:
            payloads: (m, size) distinct frames as bytes; each is decoded once.
            destination: (r,) controller that each delivery reaches.
            payload_row: (r,) row of `payloads` that it brings.

        Raises:
            CosimError: a controller or a row is out of range.
        """
        at_once = np.zeros(len(destination), np.int64)
        self.apply(self.read(payloads), destination, payload_row, at_once)

    def read(self, payloads: NDArray[np.uint8]) -> Readings:
        """Return what the frames (m, size) say, for `apply`; no controller holds them yet."""
        frames = read_frames(payloads, self._epoch_s)
        fates = _FATE_OF_VERDICT[frames.verdicts]
        sensors = self._sensor_of[frames.idcodes]
        fates[(fates == _ACCEPTED) & (sensors == _UNKNOWN)] = Fate.UNKNOWN_IDCODE
        return Readings(fates, sensors, frames.tags_ns, frames.f_hz)

    def apply(
        self,
        readings: Readings,
        destination: NDArray[np.integer],
        payload_row: NDArray[np.integer],
        moments: NDArray[np.int64],
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Hand frames that were read once to controllers; return what is believed afterwards.

        Args:
            readings: what `read` returned for the payloads.
            destination: (r,) as for `deliver`.
            payload_row: (r,) as for `deliver`.
            moments: (r,) ascending numbers, equal for deliveries that count as one.

        Returns:
            The moments (m,), each once, and the averages (m, n_controllers) after each, pu.

        Raises:
            CosimError: a controller or a row is out of range.
        """
        is_last = np.ones(len(moments), np.bool_)
        is_last[:-1] = moments[1:] != moments[:-1]
        wbar = np.empty((int(is_last.sum()), len(self._counts)))
        bad = _keep_newest(
            destination.astype(np.int64, copy=False),
            payload_row.astype(np.int64, copy=False),
            is_last,
            readings.fates,
            readings.sensors,
            readings.tags_ns,
            readings.f_hz,
            self._alpha,
            self._f0_hz,
            self._f_hz,
            self._tag_ns,
            self._counts,
            wbar,
        )
        if bad >= 0:
            raise CosimError(
                f"a delivery brings payload {payload_row[bad]} to controller {destination[bad]}; "
                f"there are {len(readings.fates)} and {len(self._counts)}, both from 0"
            )
        return moments[is_last], wbar

    @property
    def wbar_pu(self) -> NDArray[np.float64]:
        """The average (n_controllers,), pu of f0."""
        wbar = np.empty(len(self._counts))
        _average(self._f_hz, self._alpha, self._f0_hz, wbar)
        return wbar

    @property
    def held_f_hz(self) -> NDArray[np.float64]:
        """Frequencies held (n_controllers, n_sensors), Hz."""
        return self._f_hz.copy()

    @property
    def counts(self) -> dict[str, NDArray[np.int64]]:
        """Deliveries (n_controllers,) by what became of them, under the names of `Fate`."""
        return {fate.name.lower(): self._counts[:, fate].copy() for fate in Fate}

    def age_s(self, now_ns: int) -> NDArray[np.float64]:
        """Return the mean age (n_controllers,) of what is held, by time tags, s.

        A sensor of which nothing came yet counts from the start of the run. Time tags are whole
        microseconds, so a frame just measured can be tagged up to 500 ns ahead; its age is then 0.
        """
        ages_ns = self._ages_ns(now_ns)
        return ages_ns.sum(axis=1) / (ages_ns.shape[1] * NS_PER_S)

    def oldest_age_s(self, now_ns: int) -> NDArray[np.float64]:
        """Return the greatest age (n_controllers,) of what is held, s; see `age_s`."""
        return self._ages_ns(now_ns).max(axis=1) / NS_PER_S

    def _ages_ns(self, now_ns: int) -> NDArray[np.int64]:
        # max first: now_ns - _NEVER would overflow.
        return np.maximum(now_ns - np.maximum(self._tag_ns, 0), 0)


@compiled_in_place
def _first_early(
    payload_row: NDArray[np.int64],
    arrivals_ns: NDArray[np.int64],
    fates: NDArray[np.uint8],
    tags_ns: NDArray[np.int64],
) -> int:
    """Return the first delivery (of r) of an accepted frame whose tag lies behind it, or -1."""
    for i in range(len(payload_row)):
        row = payload_row[i]
        if tags_ns[row] > arrivals_ns[i] + _TAG_ROUNDING_NS and fates[row] == _ACCEPTED:
            return i
    return -1


@compiled_in_place
def _keep_newest(
    destination: NDArray[np.int64],
    payload_row: NDArray[np.int64],
    is_last: NDArray[np.bool_],
    fates: NDArray[np.uint8],
    sensors: NDArray[np.int32],
    tags_ns: NDArray[np.int64],
    f_hz: NDArray[np.float64],
    alpha: NDArray[np.float64],
    f0_hz: float,
    held_f_hz: NDArray[np.float64],
    held_ns: NDArray[np.int64],
    counts: NDArray[np.int64],
    wbar: NDArray[np.float64],
) -> int:
    """Put each accepted delivery (r,) into what its controller holds, and count them all.

    `fates`, `sensors`, `tags_ns` and `f_hz` are (m,), by payload; what is held is (n_controllers,
    n_sensors), the counts are (n_controllers, len(Fate)), and `wbar` (last ones, n_controllers)
    takes the averages after each delivery that is the last of its moment.

    Returns:
        The first delivery with a controller or a payload that is not there, or -1.
    """
    row_of_wbar = 0
    for i in range(len(destination)):
        controller, row = destination[i], payload_row[i]
        if not (0 <= controller < len(counts) and 0 <= row < len(fates)):
            return i
        fate = fates[row]
        if fate == _ACCEPTED:
            sensor = sensors[row]
            if tags_ns[row] > held_ns[controller, sensor]:
                held_f_hz[controller, sensor] = f_hz[row]
                held_ns[controller, sensor] = tags_ns[row]
            elif tags_ns[row] == held_ns[controller, sensor]:
                fate = _DUPLICATE
            else:
                fate = _LATE
        counts[controller, fate] += 1
        if is_last[i]:
            _average(held_f_hz, alpha, f0_hz, wbar[row_of_wbar])
            row_of_wbar += 1
    return -1


@compiled_in_place
def _average(
    f_hz: NDArray[np.float64],
    alpha: NDArray[np.float64],
    f0_hz: float,
    wbar: NDArray[np.float64],
) -> None:
    """Write wbar (n,) of frequencies (n, n_sensors); exactly 1 where every frequency is f0.

    With sum alpha = 1, (1/f0) sum alpha_k f_k = 1 + (1/f0) sum alpha_k (f_k - f0); in this form the
    rounding of the weights cannot move a system at rest.
    """
    n, n_sensors = f_hz.shape
    for i in range(n):
        deviation = 0.0
        for k in range(n_sensors):
            deviation += alpha[k] * (f_hz[i, k] - f0_hz)
        wbar[i] = 1.0 + deviation / f0_hz
