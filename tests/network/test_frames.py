"""The bytes of frames, from the instant of sending to the last of their packets."""

import numpy as np

from tieline.network.engine import ARRIVAL, DROP, LOSS, NO_DROPS, Outcome
from tieline.network.frames import FrameStore
from tieline.network.spec import FRAME_BYTES

SOURCES, DESTINATIONS = 3, 2


def frames_of(sequence: int) -> np.ndarray:
    """Return frames that tell their source and number."""
    frames = np.zeros((SOURCES, FRAME_BYTES), np.uint8)
    frames[:, 0], frames[:, 1] = np.arange(SOURCES), sequence
    return frames


def arrivals(*packets: tuple[int, int, int]) -> np.ndarray:
    """Return arrivals of (source, destination, sequence), one a nanosecond."""
    rows = [(k, *packet) for k, packet in enumerate(packets)]
    return np.array(rows, ARRIVAL)


def test_every_packet_hands_over_its_own_bytes():
    """Otherwise a controller would act on the frame of another PMU, or of another instant."""
    store = FrameStore(SOURCES, DESTINATIONS)
    for sequence in range(3):
        store.keep(sequence, frames_of(sequence))
    outcome = Outcome(arrivals((2, 0, 1), (0, 0, 0), (2, 1, 1), (1, 1, 0)), NO_DROPS)
    payloads, deliveries = store.take(outcome)
    assert payloads[:, :2].tolist() == [[0, 0], [1, 0], [2, 1]]
    assert payloads[deliveries["payload"], 0].tolist() == deliveries["source"].tolist()
    assert payloads[deliveries["payload"], 1].tolist() == deliveries["sequence"].tolist()
    assert deliveries["arrival_ns"].tolist() == [0, 1, 2, 3]


def test_frames_are_kept_while_a_packet_is_under_way_and_no_longer():
    """Otherwise a late packet would carry other bytes, or a long run would need more memory."""
    store = FrameStore(SOURCES, DESTINATIONS)
    everyone = [(i, j) for i in range(SOURCES) for j in range(DESTINATIONS)]
    store.keep(0, frames_of(0))
    first = arrivals(*((*pair, 0) for pair in everyone[:-1]))
    store.take(Outcome(first, NO_DROPS))
    for sequence in range(1, 100):
        store.keep(sequence, frames_of(sequence))
        lost = np.array([(0, *everyone[0], sequence, LOSS)], DROP)
        rest = arrivals(*((*pair, sequence) for pair in everyone[1:]))
        store.take(Outcome(rest, lost))
    assert len(store._under_way) == 128
    payloads, _ = store.take(Outcome(arrivals((*everyone[-1], 0)), NO_DROPS))
    assert payloads[:, :2].tolist() == [[everyone[-1][0], 0]]
    for sequence in range(100, 200):
        store.keep(sequence, frames_of(sequence))
        store.take(Outcome(arrivals(*((*pair, sequence) for pair in everyone)), NO_DROPS))
    assert len(store._under_way) == 128
