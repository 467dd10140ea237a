"""Delays counted in bins whose memory does not grow with the run, and percentiles read off them.

The bins of one flow count what a delay has beyond the flow's least possible delay. They are 1.024
us wide below 131 us, and from there between 1/128 and 1/64 of what they count: a percentile is the
middle of its bin, so it is within 0.8 % of the excess, or half a microsecond, of the exact one.
"""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled

_UNIT_BITS = 10
_HALF = 64
_LAST_SHIFT = 26
BINS = _HALF * _LAST_SHIFT + 2 * _HALF
"""Bins of one flow; the last ends at 2.4 hours and takes what is longer, too."""


@compiled
def bin_of(excess_ns: int) -> int:
    """Return the bin of an excess; a negative one counts as zero."""
    units = max(0, excess_ns) >> _UNIT_BITS
    shift = 0
    while units >> shift >= 2 * _HALF and shift < _LAST_SHIFT:
        shift += 1
    return min(_HALF * shift + (units >> shift), BINS - 1)


def middle_ns(number: int) -> float:
    """Return the middle of a bin."""
    shift = max(0, number // _HALF - 1)
    low = (number - _HALF * shift) << (shift + _UNIT_BITS)
    return low + (1 << (shift + _UNIT_BITS)) / 2


def percentile_ns(counts: NDArray[np.uint32], share: float) -> float:
    """Return the excess that `share` of the counted ones do not exceed, by nearest rank.

    Args:
        counts: (BINS,) at least one of them above zero.
        share: above 0, at most 1.
    """
    cumulative = np.cumsum(counts, dtype=np.int64)
    rank = max(1, int(np.ceil(share * cumulative[-1])))
    return middle_ns(int(np.searchsorted(cumulative, rank)))
