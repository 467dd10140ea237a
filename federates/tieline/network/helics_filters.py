"""The baseline that HELICS brings along: its own `delay` and `random_drop` filters."""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tieline.cosim.filtered import FilteredMessages
from tieline.network.engine import (
    ARRIVAL,
    DROP,
    LOSS,
    NO_DROPS,
    NO_LINKS,
    Counts,
    LinkUse,
    Outcome,
    StreamUse,
    check_not_late,
    in_order,
)
from tieline.network.spec import FRAME_BYTES, NetworkSpec

_ID = struct.Struct("<IH")


@dataclass(frozen=True, eq=False)
class _Frame:
    """The packets of one instant that have not arrived: (sources, destinations) booleans."""

    due_ns: int
    sequence: int
    sources: NDArray[np.int64]
    is_missing: NDArray[np.bool_]


class HelicsFilters:
    """Sends each packet as a HELICS message through a delay filter and, if wanted, `random_drop`.

    The messages cross a federation of their own inside this process, one endpoint for each PMU and
    each controller, with the filters on the PMUs' endpoints. A message carries the number of its
    frame and source and is as long as the frame. HELICS tells nobody of a dropped message: a packet
    counts as lost when it has not arrived by the end of its delay.

    The losses come from a generator of HELICS's that cannot be seeded, so that with `loss` above 0
    no run can be repeated. There are no links, no queues and one delay for all.

    Args:
        spec: sources and destinations.
        delay_ns: combined delay, above 0: HELICS hands over a message without delay too late.
        loss: probability of `random_drop`.

    Raises:
        CosimError: HELICS could not start.
    """

    lookahead_ns = 0

    def __init__(self, spec: NetworkSpec, delay_ns: int, loss: float) -> None:
        self._messages = FilteredMessages(
            [source.name for source in spec.sources],
            [destination.name for destination in spec.destinations],
            delay_ns,
            loss,
        )
        self._destinations = len(spec.destinations)
        self._delay_ns = delay_ns
        self._loss = loss
        self._frames: dict[int, _Frame] = {}
        self._now_ns = -1
        self._sent = self._delivered = self._dropped = 0

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames of one instant; their bytes stay here.

        Raises:
            CosimError: the last `run_until` has passed it.
        """
        check_not_late(measured_ns, self._now_ns)
        for source in sources.tolist():
            data = _ID.pack(sequence, source).ljust(FRAME_BYTES, b"\0")
            self._messages.send(source, [data] * self._destinations, measured_ns)
        is_missing = np.ones((len(sources), self._destinations), dtype=bool)
        self._sent += is_missing.size
        due_ns = measured_ns + self._delay_ns
        self._frames[sequence] = _Frame(due_ns, sequence, sources, is_missing)

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended up to and including `until_ns`.

        Raises:
            CosimError: HELICS fails, or packets are not all accounted for.
        """
        self._now_ns = until_ns
        rows = [
            (arrival_ns, source, destination, sequence)
            for arrival_ns, destination, data in self._messages.run_until(until_ns)
            for sequence, source in [_ID.unpack_from(data)]
        ]
        arrivals = in_order(np.array(rows, ARRIVAL))
        for sequence in np.unique(arrivals["sequence"]).tolist():
            frame = self._frames[sequence]
            own = arrivals[arrivals["sequence"] == sequence]
            places = np.searchsorted(frame.sources, own["source"])
            frame.is_missing[places, own["destination"]] = False
        drops = [NO_DROPS]
        for frame in [frame for frame in self._frames.values() if frame.due_ns <= until_ns]:
            drops.append(_lost(self._frames.pop(frame.sequence)))
        self._delivered += len(arrivals)
        self._dropped += sum(len(part) for part in drops)
        self.counts().check(until_ns)
        return Outcome(arrivals, np.concatenate(drops))

    def counts(self) -> Counts:
        """Return the counts at the instant of the last `run_until`."""
        in_flight = sum(int(frame.is_missing.sum()) for frame in self._frames.values())
        return Counts(self._sent, self._delivered, 0, self._dropped, in_flight)

    def links(self) -> list[LinkUse]:
        """Return nothing: there are no links."""
        return []

    def link_counters(self) -> NDArray[np.void]:
        """Return nothing: there are no links."""
        return NO_LINKS

    def streams(self) -> list[StreamUse]:
        """Return the one generator of HELICS's own, if it draws anything."""
        if self._loss == 0:
            return []
        return [StreamUse("random_drop of HELICS", "losses", None, is_seeded=False)]

    def close(self) -> None:
        """End the federation of the filters; again does nothing."""
        self._messages.close()


def _lost(frame: _Frame) -> NDArray[np.void]:
    """Return what is missing of a frame whose delay is over."""
    places, destinations = np.nonzero(frame.is_missing)
    drops = np.empty(len(places), DROP)
    drops["dropped_ns"] = frame.due_ns
    drops["source"] = frame.sources[places]
    drops["destination"] = destinations
    drops["sequence"] = frame.sequence
    drops["reason"] = LOSS
    return drops
