"""Age of information: how old the freshest frame is that a controller holds of each PMU.

S. Kaul, R. Yates, M. Gruteser: Real-time status: How often should one update? INFOCOM 2012. The age
at an instant is the time since the measurement of the freshest frame that has arrived. It grows
with time and falls when a fresher frame arrives; a frame that was overtaken changes nothing.
"""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero

NEVER = -1
"""Measurement of the freshest frame where none has arrived."""

# Columns of a flow's state: instants, then the peaks (the ages just before they fall).
_MEASURED, _FIRST, _LAST, _PEAKS, _PEAK_SUM, _MOST = range(6)


class AgeOfInformation:
    """The age of each flow, from its first arrival on.

    The mean over time is the integral of the age from the first arrival to the end by the time
    between them; the age is piecewise linear, so the integral is exact, not sampled.

    Args:
        flows: how many there are.
    """

    def __init__(self, flows: int) -> None:
        self._state = np.zeros((flows, 6), dtype=np.int64)
        self._state[:, _MEASURED] = NEVER
        self._areas = np.zeros(flows)

    @property
    def measured_ns(self) -> NDArray[np.int64]:
        """(flows,) measurement of the freshest frame held, or `NEVER`."""
        return self._state[:, _MEASURED]

    def add(
        self,
        flows: NDArray[np.int64],
        arrival_ns: NDArray[np.int64],
        measured_ns: NDArray[np.int64],
    ) -> None:
        """Take arrivals, in the order of their time."""
        _update(flows, arrival_ns, measured_ns, self._state, self._areas)

    def mean_ns(self, end_ns: int) -> NDArray[np.float64]:
        """Return each flow's mean age over time; NaN where nothing arrived, here and below."""
        last, measured = self._state[:, _LAST], self._state[:, _MEASURED]
        tails = (end_ns - last).astype(np.float64) * ((last + end_ns) / 2 - measured)
        spans = end_ns - self._state[:, _FIRST]
        # A frame that arrives at the very end is held for no time; its age is then the mean.
        means = np.where(spans > 0, (self._areas + tails) / np.maximum(spans, 1), last - measured)
        return self._where_held(means)

    def peak_mean_ns(self) -> NDArray[np.float64]:
        """Return each flow's mean peak; NaN also where only one frame arrived."""
        peaks = self._state[:, _PEAKS]
        return np.where(peaks > 0, self._state[:, _PEAK_SUM] / np.maximum(peaks, 1), np.nan)

    def max_ns(self, end_ns: int) -> NDArray[np.float64]:
        """Return each flow's greatest age, which may be that at the end."""
        return self._where_held(np.maximum(self._state[:, _MOST], end_ns - self.measured_ns))

    def _where_held(self, values: NDArray[np.generic]) -> NDArray[np.float64]:
        return np.where(self.measured_ns != NEVER, values, np.nan)


@compiled_from_zero
def _update(
    flows: NDArray[np.int64],
    arrival_ns: NDArray[np.int64],
    measured_ns: NDArray[np.int64],
    state: NDArray[np.int64],
    areas: NDArray[np.float64],
) -> None:
    for place in range(len(flows)):
        flow, now = flows[place], arrival_ns[place]
        held = state[flow, _MEASURED]
        if measured_ns[place] <= held:
            continue
        if held == NEVER:
            state[flow, _FIRST] = now
        else:
            # In floats: a product of two times in nanoseconds exceeds whole numbers after 3 s.
            span = float(now - state[flow, _LAST])
            areas[flow] += span * (0.5 * (now + state[flow, _LAST]) - held)
            state[flow, _PEAKS] += 1
            state[flow, _PEAK_SUM] += now - held
            state[flow, _MOST] = max(state[flow, _MOST], now - held)
        state[flow, _MEASURED] = measured_ns[place]
        state[flow, _LAST] = now
