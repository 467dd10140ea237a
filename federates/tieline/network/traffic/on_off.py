"""On-off traffic: it sends at a peak rate, then is silent, for random times.

With Pareto times of a shape below 2 the sum of many such flows is self-similar (W. Willinger, M.
Taqqu, R. Sherman and D. Wilson, Self-similarity through high-variability, IEEE/ACM Trans.
Networking 5, 1997).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tieline.network.draws import CHUNK, NEVER, Chunk, Chunks, chunked
from tieline.network.traffic.base import HEADER_BYTES, FlowEntry, Payload, Rate, Traffic
from tieline.units import NS_PER_S, Seconds, Unit, seconds_to_ns

MOST_PERIODS = 1000
"""Mean times on from one datagram to the next: all of them are drawn to find it."""


@dataclass(frozen=True)
class OnOff:
    """Equal gaps while on; the first time on begins after a time off.

    Attributes:
        peak_bps: rate while on.
        payload_bytes: of each datagram.
        on_ns, off_ns: mean times.
        shape: of the Pareto distribution of both times, above 1; None for exponential ones.
    """

    peak_bps: float
    payload_bytes: int
    on_ns: int
    off_ns: int
    shape: float | None = None

    @property
    def rate_bps(self) -> float:
        """The mean rate."""
        return self.peak_bps * self.on_ns / (self.on_ns + self.off_ns)

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps.

        Datagrams leave at equal gaps of the time that the flow has been on, so that what is left of
        a gap is carried into the next time on and the mean rate is exact.
        """
        return chunked(self._parts(generator), NEVER)

    def scaled(self, factor: float) -> Traffic:
        """Return it with another peak rate."""
        return replace(self, peak_bps=self.peak_bps * factor)

    def _parts(self, generator: np.random.Generator) -> Iterator[Chunk]:
        gap_ns = (self.payload_bytes + HEADER_BYTES) * 8 * NS_PER_S / self.peak_bps
        on_before = off_before = 0.0
        count, last_ns = 0, 0
        while True:
            on_until = on_before + np.cumsum(self._times(generator, self.on_ns))
            off_until = off_before + np.cumsum(self._times(generator, self.off_ns))
            end = int(on_until[-1] // gap_ns)
            for first in range(count + 1, end + 1, CHUNK):
                on_at = np.arange(first, min(first + CHUNK, end + 1)) * gap_ns
                off_at = off_until[np.minimum(np.searchsorted(on_until, on_at), CHUNK - 1)]
                instants = np.rint(np.minimum(on_at + off_at, NEVER)).astype(np.int64)
                yield np.diff(instants, prepend=last_ns)
                last_ns = int(instants[-1])
            count, on_before, off_before = end, float(on_until[-1]), float(off_until[-1])

    def _times(self, generator: np.random.Generator, mean_ns: float) -> NDArray[np.float64]:
        if self.shape is None:
            return generator.standard_exponential(CHUNK) * mean_ns
        least = mean_ns * (self.shape - 1.0) / self.shape
        return least * (1.0 + generator.pareto(self.shape, CHUNK))


class OnOffEntry(FlowEntry):
    """On-off traffic."""

    kind: Literal["on_off"] = Field(description="which traffic this is")
    rate: Rate = Field(description="rate while on, of payload, UDP and IPv4 headers")
    payload: Payload
    # Not `on` and `off`, which YAML 1.1 takes for true and false.
    mean_on: Seconds = Field(gt=0, le=1e4, description="mean time on")
    mean_off: Seconds = Field(gt=0, le=1e4, description="mean time off")
    shape: Annotated[float, Unit("1")] | None = Field(
        None, gt=1, le=10, description="shape of Pareto times; none: exponential times"
    )

    @model_validator(mode="after")
    def _sends(self) -> "OnOffEntry":
        gap_s = (self.payload + HEADER_BYTES) * 8 / self.rate
        if gap_s > MOST_PERIODS * self.mean_on:
            raise ValueError(
                f"'mean_on' must be at least 1/{MOST_PERIODS} of the {gap_s:g} s from datagram to "
                f"datagram (got {self.mean_on:g} s)"
            )
        return self

    def traffic(self) -> Traffic:
        """Return the traffic."""
        on_ns, off_ns = seconds_to_ns(self.mean_on), seconds_to_ns(self.mean_off)
        return OnOff(self.rate, self.payload, on_ns, off_ns, self.shape)
