"""The engine that draws the delay of each packet: from a distribution, or from measured delays."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tieline.network.engine import (
    ARRIVAL,
    DROP,
    LOSS,
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
from tieline.network.path_delays import CHUNK, PathDelay
from tieline.network.spec import NetworkSpec
from tieline.streams import stream


class EmpiricalDelay:
    """Delivers each packet after a delay drawn for it, or loses it with a fixed probability.

    Each path has streams of its own, so that its delays and losses depend on the seed and its name
    alone. A lost packet ends when it would have arrived. Not modelled: queues, so that paths do not
    influence one another; bursts of loss.

    Args:
        spec: sources and destinations.
        delays: of each path, source by source and destination by destination.
        loss: probability of each packet, on its own.
        keeps_order: a packet whose delay would have it overtake the last delivered one of its path
            arrives together with it; otherwise it overtakes.
        seed: the experiment's.
    """

    def __init__(
        self,
        spec: NetworkSpec,
        delays: Sequence[PathDelay],
        loss: float,
        keeps_order: bool,
        seed: int,
    ) -> None:
        self.lookahead_ns = min((delay.least_ns for delay in delays), default=0)
        self._destinations = np.arange(len(spec.destinations), dtype=np.int64)
        self._names = names = [
            f"{source.name}->{destination.name}"
            for source in spec.sources
            for destination in spec.destinations
        ]
        self._supplies = [
            delay.chunks(stream(seed, f"delay of {name}"))
            for delay, name in zip(delays, names, strict=True)
        ]
        self._delays_ns = np.empty((len(names), CHUNK), dtype=np.int64)
        self._used = np.full(len(names), CHUNK)
        self._taken = np.zeros(len(names), dtype=np.int64)
        self._loss = loss
        self._losses = [stream(seed, f"loss of {name}") for name in names]
        self._is_lost = np.zeros((len(names), CHUNK), dtype=bool)
        self._keeps_order = keeps_order
        self._last_ns = np.full(len(names), -1, dtype=np.int64)
        self._arrivals, self._drops = NO_ARRIVALS, NO_DROPS
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
            CosimError: the last `run_until` has passed the instant at which one may arrive.
        """
        check_not_late(measured_ns + self.lookahead_ns, self._now_ns)
        count = len(self._destinations)
        flows = (sources[:, np.newaxis] * count + self._destinations).ravel()
        self._sent += len(flows)
        delays_ns, is_lost = self._drawn(flows)
        ends_ns = measured_ns + delays_ns
        if self._keeps_order:
            ends_ns = np.maximum(ends_ns, self._last_ns[flows])
            self._last_ns[flows[~is_lost]] = ends_ns[~is_lost]
        frames = np.zeros(len(flows), DROP)
        frames["dropped_ns"] = ends_ns
        frames["source"] = np.repeat(sources, count)
        frames["destination"] = np.tile(self._destinations, len(sources))
        frames["sequence"] = sequence
        frames["reason"] = LOSS
        arrivals = np.empty(np.count_nonzero(~is_lost), ARRIVAL)
        for to, origin in zip(ARRIVAL.names or (), DROP.names or (), strict=False):
            arrivals[to] = frames[origin][~is_lost]
        self._arrivals = np.concatenate([self._arrivals, arrivals])
        self._drops = np.concatenate([self._drops, frames[is_lost]])

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended up to and including `until_ns`.

        Raises:
            CosimError: packets are not all accounted for.
        """
        self._now_ns = until_ns
        is_due = self._arrivals["arrival_ns"] <= until_ns
        arrivals, self._arrivals = in_order(self._arrivals[is_due]), self._arrivals[~is_due]
        is_over = self._drops["dropped_ns"] <= until_ns
        drops, self._drops = self._drops[is_over], self._drops[~is_over]
        drops = drops[np.argsort(drops["dropped_ns"], kind="stable")]
        self._delivered += len(arrivals)
        self._dropped += len(drops)
        self.counts().check(until_ns)
        return Outcome(arrivals, drops)

    def counts(self) -> Counts:
        """Return the counts at the instant of the last `run_until`."""
        in_flight = len(self._arrivals) + len(self._drops)
        return Counts(self._sent, self._delivered, 0, self._dropped, in_flight)

    def links(self) -> list[LinkUse]:
        """Return nothing: there are no links."""
        return []

    def link_counters(self) -> NDArray[np.void]:
        """Return nothing: there are no links."""
        return NO_LINKS

    def streams(self) -> list[StreamUse]:
        """Return the streams of delays and, where packets are lost, those of losses."""
        kinds = [("delay", "delays, ns")]
        if self._loss > 0:
            kinds.append(("loss", f"lost if the number is below {self._loss:g}"))
        return [
            StreamUse(f"{kind} of {name}", gives, int(taken))
            for kind, gives in kinds
            for name, taken in zip(self._names, self._taken, strict=True)
        ]

    def streams_of(self, flow: int) -> list[str]:
        """Return the stream of a path's delays and, where packets are lost, that of its losses."""
        kinds = ["delay", "loss"] if self._loss > 0 else ["delay"]
        return [f"{kind} of {self._names[flow]}" for kind in kinds]

    def close(self) -> None:
        """Do nothing: there is nothing to let go of."""

    def _drawn(self, flows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the next delay of each path, and whether the packet is lost."""
        for flow in flows[self._used[flows] == CHUNK]:
            self._delays_ns[flow] = next(self._supplies[flow])
            if self._loss > 0:
                self._is_lost[flow] = self._losses[flow].random(CHUNK) < self._loss
            self._used[flow] = 0
        places = self._used[flows]
        self._used[flows] += 1
        self._taken[flows] += 1
        return self._delays_ns[flows, places], self._is_lost[flows, places]
