"""When the frames of the PMUs enter the network."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tieline.network.draws import CHUNK
from tieline.network.engine import StreamUse
from tieline.network.packet.draws import jitters
from tieline.network.packet.supplies import JITTER
from tieline.network.spec import Source


class Pmus:
    """When the frames of sources leave them: after their processing time, and in order.

    Args:
        sources: all sources, by number.
        seed: the experiment's seed; the jitter of each source has its own stream of it.
    """

    def __init__(self, sources: Sequence[Source], seed: int) -> None:
        self._processing_ns = np.array([source.processing_ns for source in sources], np.int64)
        self._last_ns = np.full(len(sources), -1, dtype=np.int64)
        random = [number for number, source in enumerate(sources) if source.jitter is not None]
        self._row_of = np.full(len(sources), -1, dtype=np.int64)
        self._row_of[random] = np.arange(len(random))
        self._streams = [f"processing of {sources[number].name}" for number in random]
        self._supplies = [
            jitters(seed, stream, jitter)
            for number, stream in zip(random, self._streams, strict=True)
            if (jitter := sources[number].jitter) is not None
        ]
        self._draws = np.empty((len(random), CHUNK), dtype=np.int64)
        self._used = np.full(len(random), CHUNK)
        self._taken = np.zeros(len(random), dtype=np.int64)

    def ready_ns(self, measured_ns: int, sources: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return when the frames leave that some sources, each given once, measured at an instant.

        Args:
            measured_ns: the instant.
            sources: (n,) their numbers.
        """
        ready_ns = measured_ns + self._processing_ns[sources]
        rows = self._row_of[sources]
        is_random = rows >= 0
        ready_ns[is_random] += self._drawn(rows[is_random])
        ready_ns = np.maximum(ready_ns, self._last_ns[sources])
        self._last_ns[sources] = ready_ns
        return ready_ns

    def last_draw(self, source: int) -> tuple[str, int, int] | None:
        """Return the stream of a source's jitter, how many numbers were used, and the last, ns.

        None where the source has no jitter, or sent nothing.
        """
        row = self._row_of[source]
        if row < 0 or not self._taken[row]:
            return None
        draw_ns = self._draws[row, self._used[row] - 1]
        return self._streams[row], int(self._taken[row]), int(draw_ns)

    def uses(self) -> list[StreamUse]:
        """Return the stream of each source with jitter, with the numbers used so far."""
        return [
            StreamUse(stream, JITTER, int(taken))
            for stream, taken in zip(self._streams, self._taken, strict=True)
        ]

    def _drawn(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the next number of each of some supplies."""
        for row in rows[self._used[rows] == CHUNK]:
            self._draws[row] = next(self._supplies[row])
            self._used[row] = 0
        drawn: NDArray[np.int64] = self._draws[rows, self._used[rows]]
        self._used[rows] += 1
        self._taken[rows] += 1
        return drawn
