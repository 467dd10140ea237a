"""The time contract, held against a link that answers as each test likes."""

from collections.abc import Callable

import pytest

from tieline.cosim.exchange import Exchange, run_grid, run_network
from tieline.cosim.interfaces import Clock, lead_of
from tieline.cosim.wire import Kind, Ledger, split
from tieline.errors import CosimError, TimeContractBroken

CLOCK = Clock(60, 2)
T1_NS = 16_666_666
T2_NS = 33_333_333


class ScriptedLink:
    """Grants what is asked for and hands over what the test has laid out for each grant."""

    def __init__(self, arrivals: dict[int, list[tuple[int, bytes]]], late_ns: int = 0) -> None:
        self.limit_bytes: int | None = None
        self.log: list[tuple[str, int]] = []
        self._arrivals = arrivals
        self._late_ns = late_ns
        self._granted_ns = -1

    def request(self, at_ns: int) -> int:
        """Return the asked time, late by what the test says."""
        self._granted_ns = at_ns
        self.log.append(("request", at_ns))
        return at_ns + self._late_ns

    def send(self, data: bytes, at_ns: int) -> None:
        """Note the stamp."""
        self.log.append(("send", at_ns))

    def receive(self) -> list[tuple[int, bytes]]:
        """Return what is laid out for this grant."""
        return self._arrivals.get(self._granted_ns, [])


class Echo:
    """A participant that answers with what it got."""

    def __init__(self, name: str, *first: bytes) -> None:
        self.name = name
        self._first = first

    def start(self) -> list[bytes]:
        """Return the first messages."""
        return list(self._first)

    def advance(self, k: int, received: bytes) -> bytes:
        """Return what came."""
        return received

    def finish(self) -> None:
        """Nothing is left."""

    def abort(self, reason: str) -> None:
        """Nothing is left."""


def bundle(k: int, payload: bytes = b"x") -> bytes:
    """Return bundle `k` as one message."""
    return split(Kind.BUNDLE, k, payload, None)[0]


def end(*payloads: bytes, k: int = 2) -> bytes:
    """Return the end marker of a stream of `k` intervals."""
    ledger = Ledger()
    for payload in payloads:
        ledger.add(payload)
    return split(Kind.END, k, ledger.to_bytes(), None)[0]


def from_network() -> dict[int, list[tuple[int, bytes]]]:
    """Return what a good network sends in two intervals, by the grid's grants."""
    return {
        2_000: [(1_000, bundle(0))],
        T1_NS + 2_000: [(T1_NS + 1_000, bundle(1))],
        T2_NS + 2_000: [(T2_NS + 1_000, end(b"x", b"x"))],
    }


def from_grid() -> dict[int, list[tuple[int, bytes]]]:
    """Return what a good grid sends in two intervals, by the network's grants."""
    return {
        1_000: [(0, bundle(0))],
        T1_NS + 1_000: [(T1_NS, bundle(1))],
        T2_NS + 1_000: [(T2_NS, bundle(2)), (T2_NS, end(b"x", b"x", b"x"))],
    }


def run_as_grid(link: ScriptedLink) -> None:
    """Run the grid's side on a scripted link."""
    run_grid(Echo("grid", b"first"), Exchange("grid", link, CLOCK), CLOCK)


def run_as_network(link: ScriptedLink) -> None:
    """Run the network's side on a scripted link."""
    run_network(Echo("network"), Exchange("network", link, CLOCK), CLOCK)


def test_the_grid_asks_two_microseconds_after_and_stamps_its_bundle_with_the_next_instant() -> None:
    """If not, the network would see frames too early or the grid would miss deliveries."""
    link = ScriptedLink(from_network())
    run_as_grid(link)
    assert link.log == [
        ("send", 0),
        ("request", 2_000),
        ("send", T1_NS),
        ("request", T1_NS + 2_000),
        ("send", T2_NS),
        ("request", T2_NS + 2_000),
    ]


def test_the_network_asks_one_microsecond_after_and_answers_at_its_grant() -> None:
    """If not, the grid would not hold what arrived in the interval that it integrates."""
    link = ScriptedLink(from_grid())
    run_as_network(link)
    assert link.log == [
        ("request", 1_000),
        ("send", 1_000),
        ("request", T1_NS + 1_000),
        ("send", T1_NS + 1_000),
        ("request", T2_NS + 1_000),
        ("send", T2_NS + 1_000),
    ]


@pytest.mark.parametrize("side", [run_as_grid, run_as_network])
def test_a_grant_other_than_asked_for_breaks_the_contract(side: Callable) -> None:
    """If not, a bundle could be applied in the wrong interval."""
    with pytest.raises(TimeContractBroken, match="and was granted"):
        side(ScriptedLink({}, late_ns=1))


@pytest.mark.parametrize("side", [run_as_grid, run_as_network])
def test_a_bundle_that_does_not_come_breaks_the_contract(side: Callable) -> None:
    """If not, an interval would be simulated without its measurements."""
    with pytest.raises(TimeContractBroken, match=r"in interval 0: .* bundle 0 is missing"):
        side(ScriptedLink({}))


def test_a_bundle_with_a_foreign_stamp_breaks_the_contract() -> None:
    """If not, frames of one instant could count for another."""
    arrivals = from_grid()
    arrivals[1_000] = [(1, bundle(0))]
    with pytest.raises(TimeContractBroken, match="came stamped 1 ns, the contract says 0 at 0 ns"):
        run_as_network(ScriptedLink(arrivals))


def test_a_bundle_of_another_interval_breaks_the_contract() -> None:
    """If not, a federate that lost count would go on unnoticed."""
    arrivals = from_grid()
    arrivals[T1_NS + 1_000] = [(T1_NS, bundle(0))]
    with pytest.raises(TimeContractBroken, match="network in interval 1: grid's bundle 0"):
        run_as_network(ScriptedLink(arrivals))


def test_an_end_marker_that_tells_of_another_stream_is_an_error() -> None:
    """If not, a run that lost a message would end as if it were whole."""
    arrivals = from_network()
    arrivals[T2_NS + 2_000] = [(T2_NS + 1_000, end(b"x", b"y"))]
    with pytest.raises(CosimError, match="network sent 2 messages, 2 bytes"):
        run_as_grid(ScriptedLink(arrivals))


def test_a_stream_without_its_end_marker_is_an_error() -> None:
    """If not, a peer that stopped early would look finished."""
    arrivals = from_network()
    arrivals[T2_NS + 2_000] = []
    with pytest.raises(TimeContractBroken, match="network's end 2 is missing"):
        run_as_grid(ScriptedLink(arrivals))


def test_a_message_beyond_the_end_is_an_error() -> None:
    """If not, the two could disagree about the number of intervals."""
    arrivals = from_network()
    arrivals[T2_NS + 2_000].append((T2_NS + 1_000, bundle(2)))
    with pytest.raises(CosimError, match="grid was sent more than the contract knows: bundle 2"):
        run_as_grid(ScriptedLink(arrivals))


def test_a_network_that_does_not_begin_with_its_lead_is_refused() -> None:
    """If not, every later delivery would count for another interval."""
    with pytest.raises(CosimError, match="lead is 0 intervals, but it began with 1 messages"):
        run_network(Echo("network", b"x"), Exchange("network", ScriptedLink({}), CLOCK), CLOCK)


LEADING = Clock(60, 5, lead=3)
T4_NS = 66_666_666
T5_NS = 83_333_333


def test_with_a_lead_the_federates_meet_once_a_stride_with_one_message() -> None:
    """If not, one federate would have to wait for the other at every turn."""
    arrivals = {
        1_000: [(0, bundle(0))],
        T2_NS + 1_000: [(T2_NS, bundle(2))],
        T4_NS + 1_000: [(T4_NS, bundle(4))],
        T5_NS + 1_000: [(T5_NS, end(*[b"x"] * 3, k=5))],
    }
    link = ScriptedLink(arrivals)
    run_grid(Echo("grid", b"x"), Exchange("grid", link, LEADING), LEADING)
    assert link.log == [
        ("send", 0),
        ("request", 1_000),
        ("send", T2_NS),
        ("request", T2_NS + 1_000),
        ("send", T4_NS),
        ("request", T4_NS + 1_000),
        ("send", T5_NS),
        ("request", T5_NS + 1_000),
    ]


def test_with_a_lead_the_network_hands_over_the_stride_after_the_one_that_begins() -> None:
    """If not, the grid would have to wait for what arrives in the stride that it simulates."""
    arrivals = {
        1_000: [(0, bundle(0))],
        T2_NS + 1_000: [(T2_NS, bundle(2))],
        T4_NS + 1_000: [(T4_NS, bundle(4))],
        T5_NS + 1_000: [(T5_NS, bundle(5)), (T5_NS, end(*[b"x"] * 4, k=5))],
    }
    link = ScriptedLink(arrivals)
    network = Echo("network", b"x")
    run_network(network, Exchange("network", link, LEADING), LEADING)
    assert link.log == [
        ("send", 0),
        ("request", 1_000),
        ("send", T2_NS),
        ("request", T2_NS + 1_000),
        ("send", T4_NS),
        ("request", T4_NS + 1_000),
        ("send", T5_NS),
        ("request", T5_NS + 1_000),
    ]


def test_with_a_lead_a_bundle_of_another_stride_breaks_the_contract() -> None:
    """If not, deliveries could reach the grid a stride early or late."""
    link = ScriptedLink({1_000: [(0, bundle(0)), (0, bundle(2))]})
    with pytest.raises(TimeContractBroken, match=r"bundle 2 came .* the contract says 0 at 0 ns"):
        run_grid(Echo("grid", b"x"), Exchange("grid", link, LEADING), LEADING)


P_NS = 1e9 / 60


@pytest.mark.parametrize(
    ("lookahead_ns", "lead", "stride"),
    [
        (0, 0, 1),
        (P_NS - 1, 0, 1),
        (P_NS + 2, 1, 1),
        (2.9 * P_NS, 1, 1),
        (3.1 * P_NS, 3, 2),
        (88_000_000, 5, 3),
        (1_250_000_000, 19, 10),
        (None, 19, 10),
    ],
)
def test_the_lead_is_what_the_lookahead_covers(lookahead_ns, lead, stride) -> None:
    """If longer, frames would come after the instant at which they matter."""
    whole_ns = None if lookahead_ns is None else int(lookahead_ns)
    clock = Clock(60, 1000, lead_of(60, whole_ns))
    assert (clock.lead, clock.stride) == (lead, stride)
    if lead and whole_ns is not None:
        for k in range(1000):
            assert clock.at_ns(k + 1) + whole_ns > clock.at_ns(k + lead + 1)
