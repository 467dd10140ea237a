"""What is defined over a flow's sequence numbers: delay variation, loss periods, reordering.

Packets end in any order, and the definitions ask for the order of sending. So how each packet ended
is kept until every earlier packet of its flow has ended, too, and is then taken into account. The
memory is bounded by the packets under way, not by the length of the run, and the figures do not
depend on when they were handed over.
"""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.errors import CosimError

LOST = -2
"""How a lost packet ended; a delivered one ended with its delay in nanoseconds."""

_UNKNOWN = -1
_NOT_SENT = -3

_FIRST_ROOM = 2

# Columns of a flow's state. Sequence numbers before NEXT are settled, EXPECTED follows the highest
# one that has arrived.
_NEXT, _LAST_DELAY, _PAIRS, _STEPS = range(4)
_LOST, _PERIODS, _PERIOD, _LONGEST, _FIRST_LOST, _LAST_LOST = range(4, 10)
_EXPECTED, _ARRIVED, _REORDERED, _EXTENTS, _MOST_EXTENT = range(10, 15)
_COLUMNS = 15


class SequenceStatistics:
    """Delay variation, loss periods and reordering of each flow.

    A packet that is under way or was never sent is neither delivered nor lost: it ends a loss
    period, and no delay is compared with it.

    Args:
        flows: how many there are.
    """

    def __init__(self, flows: int) -> None:
        self._state = np.zeros((flows, _COLUMNS), dtype=np.int64)
        self._state[:, _LAST_DELAY] = _UNKNOWN
        self._ends = np.full((flows, _FIRST_ROOM), _UNKNOWN, dtype=np.int64)
        self._passed = np.zeros((flows, _FIRST_ROOM), dtype=np.int64)
        self._sent_up_to = np.zeros(flows, dtype=np.int64)
        # Compiles, where that is still to be done, before the federation waits for an answer.
        none = np.empty(0, dtype=np.int64)
        _take(0, none, none, none, self._state, self._ends, self._passed)

    def add_sent(self, flows: NDArray[np.int64], sequence: int) -> None:
        """Note that these flows sent a packet of this number; numbers left out were not sent."""
        gaps = sequence - self._sent_up_to[flows]
        self._sent_up_to[flows] = sequence + 1
        if gaps.any():
            numbers = [np.arange(sequence - gap, sequence) for gap in gaps]
            left_out = np.concatenate(numbers)
            self.add(np.repeat(flows, gaps), left_out, np.full(len(left_out), _NOT_SENT))

    def add(
        self,
        flows: NDArray[np.int64],
        sequences: NDArray[np.int64],
        ends: NDArray[np.int64],
    ) -> None:
        """Take how packets ended.

        Args:
            flows: (packets,) flow of each, the delivered ones in the order of their arrival.
            sequences: (packets,) their numbers.
            ends: (packets,) delay in ns, or `LOST`.

        Raises:
            CosimError: a packet ended twice.
        """
        place = 0
        while place < len(flows):
            place = _take(place, flows, sequences, ends, self._state, self._ends, self._passed)
            if place < 0:
                flow, sequence = int(flows[-1 - place]), int(sequences[-1 - place])
                raise CosimError(f"packet {sequence} of flow {flow} ended twice")
            if place < len(flows):
                self._grow()

    def figures(self) -> "SequenceFigures":
        """Return the figures up to now, those of packets behind one under way included."""
        state = self._state.copy()
        _settle_all(state, self._ends)
        return SequenceFigures(state)

    def _grow(self) -> None:
        room = self._ends.shape[1]
        numbers = self._state[:, [_NEXT]] + np.arange(room)
        rows = np.arange(len(numbers))[:, np.newaxis]
        ends = np.full((len(numbers), 2 * room), _UNKNOWN, dtype=np.int64)
        passed = np.zeros_like(ends)
        for old, new in ((self._ends, ends), (self._passed, passed)):
            new[rows, numbers % (2 * room)] = old[rows, numbers % room]
        self._ends, self._passed = ends, passed


class SequenceFigures:
    """The figures of each flow, (flows,) each; NaN where there is nothing to tell."""

    def __init__(self, state: NDArray[np.int64]) -> None:
        self._state = state

    @property
    def variation_ns(self) -> NDArray[np.float64]:
        """Mean absolute difference of the delays of consecutive packets, both delivered."""
        return self._ratio(_STEPS, _PAIRS)

    @property
    def loss_periods(self) -> NDArray[np.int64]:
        """Runs of lost packets with consecutive numbers."""
        return self._state[:, _PERIODS]

    @property
    def loss_period_mean(self) -> NDArray[np.float64]:
        """Mean length of the loss periods, packets."""
        return self._ratio(_LOST, _PERIODS)

    @property
    def loss_period_max(self) -> NDArray[np.int64]:
        """Length of the longest loss period, packets."""
        return self._state[:, _LONGEST]

    @property
    def loss_distance_mean(self) -> NDArray[np.float64]:
        """Mean difference of the numbers of a lost packet and the lost one before it."""
        steps = self._state[:, _LOST] - 1
        span = self._state[:, _LAST_LOST] - self._state[:, _FIRST_LOST]
        return np.where(steps > 0, span / np.maximum(steps, 1), np.nan)

    @property
    def reordered(self) -> NDArray[np.int64]:
        """Packets that arrived after one with a higher number."""
        return self._state[:, _REORDERED]

    @property
    def reordered_share(self) -> NDArray[np.float64]:
        """Reordered packets as a share of those delivered."""
        return self._ratio(_REORDERED, _ARRIVED)

    @property
    def extent_mean(self) -> NDArray[np.float64]:
        """Mean reordering extent of the reordered packets, packets."""
        return self._ratio(_EXTENTS, _REORDERED)

    @property
    def extent_max(self) -> NDArray[np.int64]:
        """Longest reordering extent, packets."""
        return self._state[:, _MOST_EXTENT]

    def _ratio(self, sum_: int, count: int) -> NDArray[np.float64]:
        counts = self._state[:, count]
        return np.where(counts > 0, self._state[:, sum_] / np.maximum(counts, 1), np.nan)


@compiled_from_zero
def _take(
    start: int,
    flows: NDArray[np.int64],
    sequences: NDArray[np.int64],
    ends: NDArray[np.int64],
    state: NDArray[np.int64],
    known: NDArray[np.int64],
    passed: NDArray[np.int64],
) -> int:
    """Return where it stopped for want of room, or -1 - place of a packet that ended before."""
    room = known.shape[1]
    mask = room - 1
    for place in range(start, len(flows)):
        flow, sequence = flows[place], sequences[place]
        ahead = sequence - state[flow, _NEXT]
        if ahead >= room:
            return place
        if ahead < 0 or known[flow, sequence & mask] != _UNKNOWN:
            return -1 - place
        if ends[place] >= 0:
            _arrive(flow, sequence, mask, state, passed)
        known[flow, sequence & mask] = ends[place]
        first = state[flow, _NEXT] & mask
        while known[flow, first] != _UNKNOWN:
            _settle(flow, known[flow, first], state)
            known[flow, first] = _UNKNOWN
            first = state[flow, _NEXT] & mask
    return len(flows)


@compiled_from_zero
def _arrive(
    flow: int, sequence: int, mask: int, state: NDArray[np.int64], passed: NDArray[np.int64]
) -> None:
    """Take an arrival into the reordering of RFC 4737, sections 3.3 and 4.2.1.

    `passed` holds, for each number that an arrival skipped, which arrival was the first to do so.
    """
    position = state[flow, _ARRIVED]
    state[flow, _ARRIVED] = position + 1
    if sequence >= state[flow, _EXPECTED]:
        for skipped in range(max(state[flow, _EXPECTED], state[flow, _NEXT]), sequence):
            passed[flow, skipped & mask] = position
        state[flow, _EXPECTED] = sequence + 1
        return
    extent = position - passed[flow, sequence & mask]
    state[flow, _REORDERED] += 1
    state[flow, _EXTENTS] += extent
    state[flow, _MOST_EXTENT] = max(state[flow, _MOST_EXTENT], extent)


@compiled_from_zero
def _settle(flow: int, end: int, state: NDArray[np.int64]) -> None:
    """Take into account how packet NEXT ended, when all before it have been."""
    sequence = state[flow, _NEXT]
    state[flow, _NEXT] = sequence + 1
    if end >= 0 and state[flow, _LAST_DELAY] >= 0:
        state[flow, _PAIRS] += 1
        state[flow, _STEPS] += abs(end - state[flow, _LAST_DELAY])
    state[flow, _LAST_DELAY] = end if end >= 0 else _UNKNOWN
    if end != LOST:
        state[flow, _PERIOD] = 0
        return
    if state[flow, _LOST] == 0:
        state[flow, _FIRST_LOST] = sequence
    state[flow, _LAST_LOST] = sequence
    state[flow, _LOST] += 1
    state[flow, _PERIOD] += 1
    if state[flow, _PERIOD] == 1:
        state[flow, _PERIODS] += 1
    state[flow, _LONGEST] = max(state[flow, _LONGEST], state[flow, _PERIOD])


@compiled_from_zero
def _settle_all(state: NDArray[np.int64], known: NDArray[np.int64]) -> None:
    """Settle what is known, with what is not taken as neither delivered nor lost."""
    room = known.shape[1]
    for flow in range(len(state)):
        for _ in range(room):
            _settle(flow, known[flow, state[flow, _NEXT] & (room - 1)], state)
