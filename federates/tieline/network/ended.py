"""Packets that have ended, in the numbers that statistics work with."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.units import NS_PER_S


class Ended(NamedTuple):
    """Packets in the order in which they ended, (n,) each.

    Attributes:
        flows: number of the flow.
        sequences: number of the frame.
        measured_ns: when it was measured.
        ended_ns: when it could be used, or was dropped.
        delays_ns: the time between these.
    """

    flows: NDArray[np.int64]
    sequences: NDArray[np.int64]
    measured_ns: NDArray[np.int64]
    ended_ns: NDArray[np.int64]
    delays_ns: NDArray[np.int64]


NONE_ENDED = Ended(*np.empty((5, 0), dtype=np.int64))


def ended(records: NDArray[np.void], flow_of: NDArray[np.int64], rate_hz: int) -> Ended:
    """Return what statistics need of arrivals or drops.

    Args:
        records: (n,) of `ARRIVAL` or `DROP`.
        flow_of: (sources, destinations) flow number of each pair.
        rate_hz: frames a second.
    """
    if not len(records):
        return NONE_ENDED
    assert records.dtype.names is not None
    names = (records.dtype.names[0], "source", "destination", "sequence")
    ended_ns, sources, destinations, sequences = (
        np.ascontiguousarray(records[name]) for name in names
    )
    table = np.empty((5, len(records)), dtype=np.int64)
    _describe(ended_ns, sources, destinations, sequences, flow_of, rate_hz, table)
    return Ended(*table)


@compiled_from_zero
def _describe(
    ended_ns: NDArray[np.int64],
    sources: NDArray[np.uint16],
    destinations: NDArray[np.uint16],
    sequences: NDArray[np.uint32],
    flow_of: NDArray[np.int64],
    rate_hz: int,
    table: NDArray[np.int64],
) -> None:
    last, measured_ns = np.int64(-1), np.int64(0)
    for place in range(len(ended_ns)):
        sequence = np.int64(sequences[place])
        if sequence != last:
            last, measured_ns = sequence, sequence * NS_PER_S // rate_hz
        table[0, place] = flow_of[sources[place], destinations[place]]
        table[1, place] = sequence
        table[2, place] = measured_ns
        table[3, place] = ended_ns[place]
        table[4, place] = ended_ns[place] - measured_ns
