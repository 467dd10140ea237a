"""The bytes of the frames that some packet still carries."""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.cosim.interfaces import DELIVERY
from tieline.network.engine import NO_ARRIVALS, NO_DROPS, Outcome
from tieline.network.spec import FRAME_BYTES

_FIRST_ROOM = 16


class FrameStore:
    """The frames of the instants of which a packet is still under way, in a ring of instants.

    Args:
        sources: how many frames an instant has.
        destinations: to how many controllers each goes.
    """

    def __init__(self, sources: int, destinations: int) -> None:
        self._packets = sources * destinations
        self._payloads = np.empty((_FIRST_ROOM, sources, FRAME_BYTES), np.uint8)
        self._sequences = np.full(_FIRST_ROOM, -1, dtype=np.int64)
        self._under_way = np.zeros(_FIRST_ROOM, dtype=np.int64)
        self._marks = np.zeros((_FIRST_ROOM, sources), dtype=np.int64)
        # Compiles, where that is still to be done, before the federation waits for an answer.
        self.take(Outcome(NO_ARRIVALS, NO_DROPS))

    def keep(self, sequence: int, payloads: NDArray[np.uint8]) -> None:
        """Keep the frames (sources, size) of one instant, one packet to each destination."""
        while self._under_way[sequence & (len(self._under_way) - 1)]:
            self._grow()
        place = sequence & (len(self._under_way) - 1)
        self._payloads[place] = payloads
        self._sequences[place] = sequence
        self._under_way[place] = self._packets

    def payloads_of(
        self, sources: NDArray[np.int64], sequences: NDArray[np.int64]
    ) -> NDArray[np.uint8]:
        """Return the frames (n, size) of sources and sequence numbers (n,)."""
        places = sequences & (len(self._under_way) - 1)
        frames: NDArray[np.uint8] = self._payloads[places, sources]
        return frames

    def take(self, outcome: Outcome) -> tuple[NDArray[np.uint8], NDArray[np.void]]:
        """Return what is handed over, and let go of the frames whose last packet has ended.

        Returns:
            (n, size) the payloads that arrived, each once, by sequence and source; and (arrivals,)
            of `DELIVERY`.
        """
        payloads = np.empty((len(outcome.arrivals), FRAME_BYTES), np.uint8)
        deliveries = np.empty(len(outcome.arrivals), DELIVERY)
        count = _hand_over(
            outcome.arrivals,
            self._payloads,
            self._sequences,
            self._under_way,
            self._marks,
            payloads,
            deliveries,
        )
        if len(outcome.drops):
            places = outcome.drops["sequence"] & (len(self._under_way) - 1)
            np.subtract.at(self._under_way, places, 1)
        return payloads[:count], deliveries

    def _grow(self) -> None:
        room = len(self._under_way)
        places = self._sequences & (2 * room - 1)
        held = self._sequences >= 0
        for name in ("_payloads", "_sequences", "_under_way", "_marks"):
            old = getattr(self, name)
            new = np.zeros((2 * room, *old.shape[1:]), old.dtype)
            new[places[held]] = old[held]
            setattr(self, name, new)


@compiled_from_zero
def _hand_over(
    arrivals: NDArray[np.void],
    frames: NDArray[np.uint8],
    sequences: NDArray[np.int64],
    under_way: NDArray[np.int64],
    marks: NDArray[np.int64],
    payloads: NDArray[np.uint8],
    deliveries: NDArray[np.void],
) -> int:
    """Write payloads and deliveries; return how many payloads there are.

    Args:
        arrivals: in order.
        frames: (room, sources, size) the ring of frames.
        sequences, under_way: (room,) of each instant in it, the number and the packets.
        marks: (room, sources) zeros, as they are again afterwards.
        payloads: (arrivals, size) room for the payloads.
        deliveries: (arrivals,) room for the deliveries.
    """
    mask = len(under_way) - 1
    first, last = np.int64(1 << 62), np.int64(-1)
    for arrival in arrivals:
        sequence = np.int64(arrival["sequence"])
        first, last = min(first, sequence), max(last, sequence)
        marks[sequence & mask, arrival["source"]] = -1
    count = 0
    for number in range(first, last + 1):
        place = np.int64(number & mask)
        if sequences[place] != number:
            continue
        for source in range(marks.shape[1]):
            if marks[place, source] < 0:
                for byte in range(frames.shape[2]):
                    payloads[count, byte] = frames[place, source, byte]
                marks[place, source] = count
                count += 1
    for number in range(len(arrivals)):
        arrival, delivery = arrivals[number], deliveries[number]
        place = np.int64(arrival["sequence"]) & mask
        delivery["arrival_ns"] = arrival["arrival_ns"]
        delivery["source"] = arrival["source"]
        delivery["destination"] = arrival["destination"]
        delivery["sequence"] = arrival["sequence"]
        delivery["payload"] = marks[place, arrival["source"]]
        under_way[place] -= 1
    for arrival in arrivals:
        marks[np.int64(arrival["sequence"]) & mask, arrival["source"]] = 0
    return count
