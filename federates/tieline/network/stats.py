"""Counts and delays of every PMU flow, gathered as the run goes in memory that does not grow."""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.network.ended import NONE_ENDED, Ended
from tieline.network.engine import LINK_DOWN, LOSS, QUEUE_FULL, Counts
from tieline.network.histogram import Histograms, count
from tieline.network.sequence import LOST, SequenceFigures, SequenceStatistics

DELAY_BIN_NS = 100_000
"""Width of the bins of the histogram over all flows."""

DELAY_BINS = 200_000
"""They reach to 20 s; one more takes what is longer."""

# Columns of a flow's delays.
_COUNT, _SUM, _LEAST, _MOST, _LAST = range(5)


class FlowStatistics:
    """What became of the packets of each flow, and how long they took.

    The delay of a packet is its combined delay, from the measurement to the instant at which the
    controller can use it: the one-way delay of RFC 7679 with the processing at both ends added.
    `docs/network_statistics.md` defines every figure.

    Attributes:
        sent, delivered, dropped_queue, dropped_loss, dropped_down: (flows,) packets so far.
        delay_counts: (DELAY_BINS + 1,) delivered packets of all flows by delay.

    Args:
        least_ns: (flows,) the least delay that each flow can have.
        flow_of: (sources, destinations) flow number of each pair.
    """

    def __init__(self, least_ns: NDArray[np.int64], flow_of: NDArray[np.int64]) -> None:
        flows = len(least_ns)
        self._least_ns = least_ns
        self._flow_of = flow_of
        self._sent = np.zeros(len(flow_of), dtype=np.int64)
        self.dropped_queue = np.zeros(flows, dtype=np.uint32)
        self.dropped_loss = np.zeros(flows, dtype=np.uint32)
        self.dropped_down = np.zeros(flows, dtype=np.uint32)
        self.delay_counts = np.zeros(DELAY_BINS + 1, dtype=np.int64)
        self._delays = np.zeros((flows, 5), dtype=np.int64)
        self._smoothed_ns = np.zeros(flows)
        self._histograms = Histograms(flows)
        self._order = SequenceStatistics(flows)
        # Compiles, where that is still to be done, before the federation waits for an answer.
        self.add(NONE_ENDED, NONE_ENDED, np.empty(0, np.uint8))

    @property
    def sent(self) -> NDArray[np.int64]:
        """Packets whose frame was measured."""
        sent = np.zeros(len(self._least_ns), dtype=np.int64)
        sent[self._flow_of] = self._sent[:, np.newaxis]
        return sent

    @property
    def delivered(self) -> NDArray[np.int64]:
        """Packets that their controller can use."""
        return self._delays[:, _COUNT]

    @property
    def in_flight(self) -> NDArray[np.int64]:
        """Packets sent that have neither been delivered nor dropped."""
        dropped = self.dropped_queue + self.dropped_loss + self.dropped_down
        return self.sent - self.delivered - dropped

    def add_sent(self, sources: NDArray[np.int64], sequence: int) -> None:
        """Count packet `sequence` from each of these sources to every destination."""
        self._sent[sources] += 1
        self._order.add_sent(self._flow_of[sources].ravel(), sequence)

    def add(self, arrived: Ended, lost: Ended, reasons: NDArray[np.uint8]) -> None:
        """Take what ended.

        Args:
            arrived: packets in the order of their arrival.
            lost: packets that were dropped.
            reasons: why, of each.

        Raises:
            CosimError: a packet ended twice.
        """
        place = self._add_delays(0, arrived)
        while place < len(arrived.flows):
            self._histograms.grow()
            place = self._add_delays(place, arrived)
        self._order.add(arrived.flows, arrived.sequences, arrived.delays_ns)
        if len(reasons):
            np.add.at(self.dropped_queue, lost.flows[reasons == QUEUE_FULL], 1)
            np.add.at(self.dropped_loss, lost.flows[reasons == LOSS], 1)
            np.add.at(self.dropped_down, lost.flows[reasons == LINK_DOWN], 1)
            self._order.add(lost.flows, lost.sequences, np.full(len(reasons), LOST))

    def counts(self) -> Counts:
        """Return the packets of all flows so far; what is in flight is what has not ended."""
        return Counts(
            sent=int(self.sent.sum()),
            delivered=int(self.delivered.sum()),
            dropped_queue=int(self.dropped_queue.sum()),
            dropped_loss=int(self.dropped_loss.sum()),
            in_flight=int(self.in_flight.sum()),
            dropped_down=int(self.dropped_down.sum()),
        )

    def _add_delays(self, start: int, arrived: Ended) -> int:
        """Take delays from a place on; return where it stopped for want of room for bins."""
        stop: int = _add_delays(
            start,
            arrived.flows,
            arrived.delays_ns,
            self._least_ns,
            self._delays,
            self._smoothed_ns,
            self._histograms.block_of,
            self._histograms.counts,
            self._histograms.carries,
            self._histograms.used,
            self.delay_counts,
        )
        return stop

    def order(self) -> SequenceFigures:
        """Return what is defined over sequence numbers."""
        return self._order.figures()

    def mean_ns(self) -> NDArray[np.float64]:
        """Return each flow's mean delay; NaN where nothing arrived, here and below."""
        return self._where_delivered(self._delays[:, _SUM] / np.maximum(self.delivered, 1))

    def min_ns(self) -> NDArray[np.float64]:
        """Return each flow's least delay."""
        return self._where_delivered(self._delays[:, _LEAST])

    def max_ns(self) -> NDArray[np.float64]:
        """Return each flow's longest delay."""
        return self._where_delivered(self._delays[:, _MOST])

    def jitter_ns(self) -> NDArray[np.float64]:
        """Return each flow's mean absolute IP packet delay variation (RFC 3393).

        It is taken over packets with consecutive numbers that were both delivered, in whatever
        order they arrived; NaN where there is no such pair.
        """
        return self.order().variation_ns

    def smoothed_jitter_ns(self) -> NDArray[np.float64]:
        """Return each flow's interarrival jitter of RFC 3550, section 6.4.1, after its last one."""
        return np.where(self.delivered > 1, self._smoothed_ns, np.nan)

    def percentiles_ns(self, share: float) -> NDArray[np.float64]:
        """Return the delay that `share` of each flow's packets do not exceed."""
        delays_ns = self._least_ns + self._histograms.percentiles_ns(share)
        bounds = self._delays[:, _LEAST], self._delays[:, _MOST]
        return self._where_delivered(np.clip(delays_ns, *bounds))

    def _where_delivered(self, values: NDArray[np.generic]) -> NDArray[np.float64]:
        return np.where(self.delivered > 0, values, np.nan)


@compiled_from_zero
def _add_delays(
    start: int,
    flows: NDArray[np.int64],
    delays_ns: NDArray[np.int64],
    least_ns: NDArray[np.int64],
    delays: NDArray[np.int64],
    smoothed_ns: NDArray[np.float64],
    block_of: NDArray[np.int32],
    bins: NDArray[np.uint16],
    carries: NDArray[np.uint32],
    used: NDArray[np.int64],
    counts: NDArray[np.int64],
) -> int:
    for place in range(start, len(flows)):
        flow = flows[place]
        delay_ns = delays_ns[place]
        if not count(flow, delay_ns - least_ns[flow], block_of, bins, carries, used):
            return place
        counts[min(delay_ns // DELAY_BIN_NS, DELAY_BINS)] += 1
        if delays[flow, _COUNT] == 0:
            delays[flow, _LEAST] = delay_ns
        else:
            step_ns = abs(delay_ns - delays[flow, _LAST])
            smoothed_ns[flow] += (step_ns - smoothed_ns[flow]) / 16
        delays[flow, _COUNT] += 1
        delays[flow, _SUM] += delay_ns
        delays[flow, _LEAST] = min(delays[flow, _LEAST], delay_ns)
        delays[flow, _MOST] = max(delays[flow, _MOST], delay_ns)
        delays[flow, _LAST] = delay_ns
    return len(flows)
