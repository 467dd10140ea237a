"""When the frames of a PMU enter the network."""

from tieline.network.packet.draws import jitters
from tieline.network.spec import Source


class Pmu:
    """When a source's frames leave it: after its processing time, and in order."""

    def __init__(self, source: Source, seed: int) -> None:
        self._processing_ns = source.processing_ns
        self._chunks = (
            None
            if source.jitter is None
            else jitters(seed, f"processing of {source.name}", source.jitter)
        )
        self._chunk: list[int] = []
        self._last_ns = -1

    def ready_ns(self, measured_ns: int) -> int:
        """Return when the frame measured at an instant leaves."""
        ready_ns = measured_ns + self._processing_ns
        if self._chunks is not None:
            if not self._chunk:
                self._chunk = next(self._chunks).tolist()[::-1]
            ready_ns += self._chunk.pop()
        self._last_ns = max(self._last_ns, ready_ns)
        return self._last_ns
