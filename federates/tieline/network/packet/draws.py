"""The random numbers that the kernel takes, one endless supply for each random thing."""

import numpy as np

from tieline.network.draws import CHUNK, NEVER, Chunks, chunked
from tieline.network.jitter import Jitter
from tieline.network.packet.red import CERTAIN
from tieline.network.spec import CrossFlow
from tieline.network.traffic.base import UDP_HEADER, Acknowledged, Sized
from tieline.streams import stream

_LONG_NS = 1 << 47
"""A gap of 39 hours; longer ones count as this, so that a chunk of them still has a sum."""


def jitters(seed: int, name: str, jitter: Jitter) -> Chunks:
    """Yield chunks of delays of a distribution, in nanoseconds."""
    generator = stream(seed, name)
    while True:
        yield jitter.draw(generator, CHUNK)


def uniforms(seed: int, name: str) -> Chunks:
    """Yield chunks of whole numbers, equally likely from 0 to 2^30 - 1."""
    generator = stream(seed, name)
    while True:
        yield generator.integers(CERTAIN, size=CHUNK, dtype=np.int64)


def gaps(seed: int, flow: CrossFlow) -> Chunks:
    """Yield chunks of the times between a cross flow's datagrams, the first counted from zero.

    A connection has two: when it begins and, after that, when it ends.
    """
    now_ns = flow.start_ns
    if isinstance(flow.traffic, Acknowledged):
        stop_ns = now_ns + NEVER if flow.stop_ns is None else flow.stop_ns
        yield from chunked([np.array([now_ns, stop_ns - now_ns])], NEVER)
    is_first = True
    for chunk in flow.traffic.gaps(stream(seed, f"arrivals of {flow.name}")):
        instants = now_ns + np.cumsum(np.minimum(chunk, _LONG_NS))
        shifted = chunk.copy()
        if is_first:
            shifted[0] = min(shifted[0], _LONG_NS) + flow.start_ns
        if flow.stop_ns is not None:
            shifted[instants >= flow.stop_ns] = NEVER
        now_ns, is_first = min(int(instants[-1]), NEVER), False
        yield shifted


def sizes(flow: CrossFlow) -> Chunks | None:
    """Return chunks of the datagrams' sizes, UDP header included; None if all are alike."""
    if not isinstance(flow.traffic, Sized):
        return None
    return (chunk + UDP_HEADER for chunk in flow.traffic.sizes())
