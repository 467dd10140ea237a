"""When the frames of a PMU enter the network."""

from tieline.network.engine import StreamUse
from tieline.network.packet.draws import jitters
from tieline.network.packet.supplies import JITTER
from tieline.network.spec import Source


class Pmu:
    """When a source's frames leave it: after its processing time, and in order.

    Attributes:
        stream: the name of the stream of its jitter.
        drawn: numbers of that stream used so far.
        last_draw_ns: the last of them, 0 before the first.
    """

    def __init__(self, source: Source, seed: int) -> None:
        self.stream = f"processing of {source.name}"
        self.drawn = self.last_draw_ns = 0
        self._processing_ns = source.processing_ns
        self._chunks = None if source.jitter is None else jitters(seed, self.stream, source.jitter)
        self._chunk: list[int] = []
        self._last_ns = -1

    def ready_ns(self, measured_ns: int) -> int:
        """Return when the frame measured at an instant leaves."""
        ready_ns = measured_ns + self._processing_ns
        if self._chunks is not None:
            if not self._chunk:
                self._chunk = next(self._chunks).tolist()[::-1]
            self.last_draw_ns = self._chunk.pop()
            self.drawn += 1
            ready_ns += self.last_draw_ns
        self._last_ns = max(self._last_ns, ready_ns)
        return self._last_ns

    def use(self) -> StreamUse | None:
        """Return its stream, with the numbers used so far; None without jitter."""
        return None if self._chunks is None else StreamUse(self.stream, JITTER, self.drawn)
