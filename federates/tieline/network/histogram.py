"""Delays counted in bins whose memory does not grow with the run, and percentiles read off them.

The bins of one flow count what a delay has beyond the flow's least possible delay. They are 1.024
us wide below 131 us, and from there between 1/128 and 1/64 of what they count: a percentile is the
middle of its bin, so it is within 0.8 % of the excess, or half a microsecond, of the exact one.
"""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero, inlined

_UNIT_BITS = 10
_HALF_BITS = 6
_HALF = 1 << _HALF_BITS
_LAST_SHIFT = 26
_MOST = (1 << 16) - 1
_FIRST_PARTS = 2
BINS = _HALF * _LAST_SHIFT + 2 * _HALF
"""Bins of one flow; the last ends at 2.4 hours and takes what is longer, too."""


@compiled_from_zero
def bin_of(excess_ns: int) -> int:
    """Return the bin of an excess; a negative one counts as zero."""
    units = max(0, excess_ns) >> _UNIT_BITS
    shift = 0
    # As numbers, not as branches, which would be a matter of chance.
    for step in (16, 8, 4, 2, 1):
        shift += step * (units >> (shift + step) >= _HALF)
    shift = min(shift, _LAST_SHIFT)
    return min(_HALF * shift + (units >> shift), BINS - 1)


def middle_ns(number: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the middle of bins, of the shape of their numbers."""
    shift = np.maximum(0, number // _HALF - 1)
    low = (number - _HALF * shift) << (shift + _UNIT_BITS)
    middle: NDArray[np.float64] = low + (1 << (shift + _UNIT_BITS)) / 2
    return middle


class Histograms:
    """The bins of many flows, which a flow has only where its delays are, 64 at a time.

    Attributes:
        block_of: (flows, parts) the row of `counts` that holds 64 bins of a flow, or -1; there are
            as many parts as the longest delay needs.
        counts: (rows, 64) the bins; rows are taken in order.
        carries: (rows, 64) how often each bin has been full and begun anew, or (0, 64) if none has.
        used: (2,) how many rows are taken, and the last part that was needed.
    """

    def __init__(self, flows: int) -> None:
        self.block_of = np.full((flows, _FIRST_PARTS), -1, dtype=np.int32)
        self.counts = np.zeros((max(1, flows), _HALF), dtype=np.uint16)
        self.carries = np.zeros((0, _HALF), dtype=np.uint32)
        self.used = np.zeros(2, dtype=np.int64)

    def grow(self) -> None:
        """Make room for what `count` had none for: parts, half as many rows again, or carries."""
        old, parts = len(self.counts), self.block_of.shape[1]
        if self.used[1] >= parts:
            more = self.used[1] + 1 - parts
            self.block_of = np.pad(self.block_of, ((0, 0), (0, more)), constant_values=-1)
            return
        if self.used[0] < old:
            self.carries = np.zeros((old, _HALF), dtype=np.uint32)
            return
        more = old // 2 + 1
        self.counts = np.pad(self.counts, ((0, more), (0, 0)))
        if len(self.carries):
            self.carries = np.pad(self.carries, ((0, more), (0, 0)))

    def percentiles_ns(self, share: float) -> NDArray[np.float64]:
        """Return (flows,) the excess that `share` of each flow's do not exceed, by nearest rank.

        Args:
            share: above 0, at most 1. Of a flow without any the result means nothing.
        """
        bins = np.zeros(len(self.block_of), dtype=np.int64)
        _rank(share, self.block_of, self.counts, self.carries, bins)
        return middle_ns(bins)


@compiled_from_zero
def count(
    flow: int,
    excess_ns: int,
    block_of: NDArray[np.int32],
    counts: NDArray[np.uint16],
    carries: NDArray[np.uint32],
    used: NDArray[np.int64],
) -> bool:
    """Count an excess of a flow; return whether there was room for that."""
    number = bin_of(excess_ns)
    if number >> _HALF_BITS >= block_of.shape[1]:
        used[1] = number >> _HALF_BITS
        return False
    block = block_of[flow, number >> _HALF_BITS]
    if block < 0:
        block = used[0]
        if block == len(counts):
            return False
        block_of[flow, number >> _HALF_BITS] = block
        used[0] += 1
    place = number & (_HALF - 1)
    if counts[block, place] == _MOST:
        if len(carries) == 0:
            return False
        carries[block, place] += 1
        counts[block, place] = 0
    else:
        counts[block, place] += 1
    return True


@inlined
def _held(
    block: int, place: int, counts: NDArray[np.uint16], carries: NDArray[np.uint32]
) -> np.int64:
    """Return what a bin has counted."""
    # Plain NumPy would keep to small and to unsigned numbers.
    held = np.int64(counts[block, place])
    if len(carries) > 0:
        held += np.int64(carries[block, place]) * (_MOST + 1)
    return held


@compiled_from_zero
def _rank(
    share: float,
    block_of: NDArray[np.int32],
    counts: NDArray[np.uint16],
    carries: NDArray[np.uint32],
    bins: NDArray[np.int64],
) -> None:
    for flow in range(len(block_of)):
        total = np.int64(0)
        for part in range(block_of.shape[1]):
            if block_of[flow, part] >= 0:
                for place in range(_HALF):
                    total += _held(block_of[flow, part], place, counts, carries)
        left = np.int64(max(1, int(np.ceil(share * total))))
        for part in range(block_of.shape[1]):
            if block_of[flow, part] < 0:
                continue
            for place in range(_HALF):
                if left > 0:
                    left -= _held(block_of[flow, part], place, counts, carries)
                    bins[flow] = _HALF * part + place
