"""The engine without a network: every packet arrives after the same delay, which may be zero."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from tieline.network.engine import (
    ARRIVAL,
    NO_ARRIVALS,
    NO_DROPS,
    NO_LINKS,
    Counts,
    LinkUse,
    Outcome,
    StreamUse,
    check_not_late,
    in_order,
)


class ConstantDelay:
    """Delivers every packet `delay_ns` after its measurement; nothing is lost or re-ordered.

    Args:
        destinations: how many controllers get each frame.
        delay_ns: the combined delay, 0 for ideal communication.
    """

    def __init__(self, destinations: int, delay_ns: int) -> None:
        self.lookahead_ns = delay_ns
        self._destinations = np.arange(destinations, dtype=np.int64)
        self._delay_ns = delay_ns
        self._waiting: deque[NDArray[np.void]] = deque()
        self._now_ns = -1
        self._sent = 0
        self._delivered = 0

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames of one instant; their bytes stay here.

        Raises:
            CosimError: the last `run_until` has passed the instant at which they arrive.
        """
        check_not_late(measured_ns + self.lookahead_ns, self._now_ns)
        frames = np.empty(len(sources) * len(self._destinations), ARRIVAL)
        frames["arrival_ns"] = measured_ns + self._delay_ns
        frames["source"] = np.repeat(sources, len(self._destinations))
        frames["destination"] = np.tile(self._destinations, len(sources))
        frames["sequence"] = sequence
        self._sent += len(frames)
        if len(frames):
            self._waiting.append(frames)

    def run_until(self, until_ns: int) -> Outcome:
        """Return what arrived up to and including `until_ns`.

        Raises:
            CosimError: packets are not all accounted for.
        """
        self._now_ns = until_ns
        due = []
        while self._waiting and self._waiting[0]["arrival_ns"][0] <= until_ns:
            due.append(self._waiting.popleft())
        arrivals = in_order(np.concatenate(due)) if due else NO_ARRIVALS
        self._delivered += len(arrivals)
        self.counts().check(until_ns)
        return Outcome(arrivals, NO_DROPS)

    def counts(self) -> Counts:
        """Return the counts at the instant of the last `run_until`."""
        in_flight = sum(len(frames) for frames in self._waiting)
        return Counts(self._sent, self._delivered, 0, 0, in_flight)

    def links(self) -> list[LinkUse]:
        """Return nothing: there are no links."""
        return []

    def link_counters(self) -> NDArray[np.void]:
        """Return nothing: there are no links."""
        return NO_LINKS

    def streams(self) -> list[StreamUse]:
        """Return nothing: nothing is random."""
        return []

    def close(self) -> None:
        """Do nothing: there is nothing to let go of."""
