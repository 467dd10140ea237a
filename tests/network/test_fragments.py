"""Datagrams above the MTU go in pieces; requests are answered.

A piece carries a multiple of eight bytes of the UDP datagram and an IP header of 20 (RFC 791).
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from network.builders import joined
from tieline.errors import InputError
from tieline.network.draws import NEVER, chunked
from tieline.network.packet import PacketEngine
from tieline.network.queues import DropTail
from tieline.network.spec import CrossFlow, Link, NetworkSpec, Reroute
from tieline.network.traffic import Greedy, Polling, Traffic

SECOND = 10**9


@dataclass(frozen=True)
class Datagrams:
    """Datagrams of one size that leave one second apart, the first at once."""

    payload_bytes: int
    count: int = 1
    rate_bps: float = 0.0

    def gaps(self, generator):
        """Yield the gaps."""
        return chunked([np.array([0] + [SECOND] * (self.count - 1))], NEVER)

    def scaled(self, factor):
        """Return it as it is."""
        return self


def line(traffic: Traffic, *mtus: int, **more: object) -> NetworkSpec:
    """Return n0 - n1 - ... of 1 Mbit/s and 1 ms, listened to, with a flow along all of it."""
    links = [
        Link(f"n{i}", f"n{i + 1}", 1_000_000, 1_000_000, DropTail(50), mtu_bytes=mtu, **more)
        for i, mtu in enumerate(mtus)
    ]
    flow = CrossFlow("cross flow 0", traffic, ("n0", f"n{len(mtus)}"))
    return replace(joined(links, [], [], [flow]), taps=tuple(range(len(links))))


def sizes(engine: PacketEngine, port: int) -> list[int]:
    """Return the IP bytes of the packets of a port since the last look, in order."""
    taps = engine.tapped()
    return taps["bytes"][taps["port"] == port].tolist()


@pytest.mark.parametrize(
    ("payload", "mtus", "pieces"),
    [
        (1472, (1500,), [1500]),
        (1473, (1500,), [1500, 21]),
        (3000, (1500,), [1500, 1500, 68]),
        (3000, (1500, 600), [596] * 5 + [148]),
        (34, (68,), [62]),
        (41, (68,), [68, 21]),
    ],
)
def test_pieces_by_hand(payload, mtus, pieces):
    """Otherwise large datagrams would load slow links as no network lets them."""
    engine = PacketEngine(line(Datagrams(payload), *mtus), seed=1)
    engine.run_until(SECOND)
    taps = engine.tapped()
    first, last = (taps["bytes"][taps["port"] == 2 * k].tolist() for k in (0, len(mtus) - 1))
    assert first == last == pieces
    assert engine.counts().delivered == len(pieces)
    # Back to back, each in its own time.
    starts = taps["sent_ns"][taps["port"] == 0]
    assert starts.tolist() == np.concatenate([[0], np.cumsum(pieces)[:-1] * 8_000]).tolist()


def test_link_bytes_are_added_to_each_piece():
    """Otherwise the overhead of small pieces, the price of a small MTU, would be lost."""
    engine = PacketEngine(line(Datagrams(3000), 1500, overhead_bytes=9), seed=1)
    engine.run_until(SECOND)
    use = engine.links()[0]
    assert (use.packets, use.bytes) == (3, 1500 + 1500 + 68 + 3 * 9)
    assert use.busy_ns == use.bytes * 8_000


def test_a_request_is_answered_once_after_the_time_to_think():
    """Otherwise polling would load one direction alone.

    A request is 40 bytes (320 us), a reply 278.
    """
    engine = PacketEngine(line(Polling(SECOND, 12, 250, 5_000_000), 1500), seed=4)
    engine.run_until(10 * SECOND)
    taps = engine.tapped()
    asked, answered = (taps["sent_ns"][taps["port"] == port] for port in (0, 1))
    assert len(asked) == 10
    assert set(np.diff(asked).tolist()) == {SECOND}
    assert (answered - asked).tolist() == [320_000 + 1_000_000 + 5_000_000] * 10
    assert set(taps["bytes"][taps["port"] == 1].tolist()) == {278}


def test_a_large_reply_goes_in_pieces():
    """Otherwise the file of a substation would pass a slow link as one packet."""
    engine = PacketEngine(line(Polling(SECOND, 12, 3000, 0), 1500), seed=4)
    engine.run_until(3 * SECOND)
    assert sizes(engine, port=1) == [1500, 1500, 68] * 3


@pytest.mark.parametrize(
    ("traffic", "mtu", "said"),
    [
        (Polling(SECOND, 2000, 250, 0), 1500, "a request of 2028 bytes exceeds the MTU"),
        (Greedy(1460, 10), 1500, "a segment of 1512 bytes exceeds the MTU"),
        (Datagrams(100), 60, "must be at least 68 bytes"),
    ],
)
def test_what_cannot_go_in_pieces_is_refused(traffic, mtu, said):
    """Otherwise a request would be answered once a piece, or a segment acknowledged so."""
    with pytest.raises(InputError, match=said):
        PacketEngine(line(traffic, mtu), seed=1)


def ring(traffic: Traffic, mtu_before: int, mtu_after: int) -> NetworkSpec:
    """Return a flow from a to b that goes by c after half a second."""
    made = [("a", "b", mtu_before), ("a", "c", mtu_after), ("c", "b", mtu_after)]
    links = [Link(a, b, 1_000_000, 1_000_000, DropTail(50), mtu_bytes=mtu) for a, b, mtu in made]
    spec = joined(links, [], [], [CrossFlow("cross flow 0", traffic, ("a", "b"))])
    assert spec.cross_flows[0].route == ("a", "b")
    change = Reroute(SECOND // 2, {0: ("a", "c", "b")}, {0: ("b", "c", "a")})
    return replace(spec, changes=(change,), taps=(0, 1, 2))


@pytest.mark.parametrize(
    ("before", "after", "pieces"),
    [(1500, 600, [596] * 5 + [148]), (1500, 9000, [3028]), (9000, 1500, [1500, 1500, 68])],
)
def test_another_route_has_its_own_pieces(before, after, pieces):
    """Otherwise a datagram would keep the pieces of a route that it no longer takes."""
    engine = PacketEngine(ring(Datagrams(3000, 2), before, after), seed=1)
    engine.run_until(SECOND // 2)
    assert sum(sizes(engine, 0)) > 3000
    engine.run_until(2 * SECOND)
    assert sizes(engine, port=2) == pieces
    assert engine.links()[2].busy_ns == sum(pieces) * 8_000


def test_a_route_for_which_segments_are_too_large_is_refused():
    """Otherwise a connection would send what its new way does not carry."""
    with pytest.raises(InputError, match="a segment of 1052 bytes exceeds the MTU"):
        PacketEngine(ring(Greedy(1000, 10), 1500, 600), seed=1)
