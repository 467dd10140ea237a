"""One tapped link, loaded with recorded traffic, for tests of queues against theory."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from network.builders import joined
from tieline.network.packet import PacketEngine
from tieline.network.queues import Queue
from tieline.network.spec import CrossFlow, Link, NetworkSpec
from tieline.network.traffic import HEADER_BYTES, Trace
from tieline.streams import stream

Numbers = NDArray[np.int64]


def poisson_times(seed: int, mean_gap_ns: float, count: int) -> Numbers:
    """Return the instants of a Poisson process."""
    gaps = stream(seed, "arrivals").standard_exponential(count) * mean_gap_ns
    return np.rint(np.cumsum(gaps)).astype(np.int64)


def exponential_sizes(seed: int, mean_bytes: float, count: int) -> Numbers:
    """Return exponential sizes of IP packets, at least a header and one byte."""
    sizes = np.rint(stream(seed, "sizes").standard_exponential(count) * mean_bytes)
    return np.maximum(HEADER_BYTES + 1, sizes).astype(np.int64)


def recorded(
    times_ns: Numbers, ip_bytes: Numbers | int, dscp: int = 0, name: str = "0"
) -> CrossFlow:
    """Return a flow from a to b of packets of given sizes."""
    sizes = np.broadcast_to(np.asarray(ip_bytes, dtype=np.int64), times_ns.shape)
    return CrossFlow(name, Trace(times_ns, sizes - HEADER_BYTES), ("a", "b"), dscp=dscp)


def one_link(rate_bps: int, queue: Queue, *flows: CrossFlow, **more: object) -> NetworkSpec:
    """Return one tapped link without propagation; it takes packets of every size."""
    link = Link("a", "b", rate_bps, 0, queue, mtu_bytes=66_000, **more)  # type: ignore[arg-type]
    return replace(joined([link], [], [], flows), taps=(0,))


def waits_ns(spec: NetworkSpec) -> list[Numbers]:
    """Return, flow by flow, how long packets wait; nothing may be dropped."""
    engine = PacketEngine(spec, seed=1)
    engine.run_until(10**17)
    records = engine.tapped()
    waits = []
    for number, flow in enumerate(spec.cross_flows):
        assert isinstance(flow.traffic, Trace)
        starts = records["sent_ns"][records["flow"] == number]
        waits.append(starts - flow.traffic.times_ns)
    return waits


def mean_and_error(values: Numbers, batches: int = 40) -> tuple[float, float]:
    """Return the mean of a correlated sequence and its standard error, by means of batches."""
    whole = values[len(values) % batches :]
    means = whole.reshape(batches, -1).mean(axis=1)
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(batches))
