"""The time loop: who is granted when, what is sent with which stamp, and what must have come."""

from collections.abc import Callable
from typing import Protocol

from tieline.cosim.interfaces import GRID, NETWORK, Clock, Participant, lag_ns
from tieline.cosim.wire import Kind, Ledger, Part, join, put_together, read_parts, split
from tieline.errors import CosimError, TimeContractBroken
from tieline.units import ns_to_seconds

PEER = {GRID: NETWORK, NETWORK: GRID}


class Link(Protocol):
    """What the loop needs of a federation: time requests and stamped messages."""

    limit_bytes: int | None

    def request(self, at_ns: int) -> int:
        """Return the instant granted for a request of `at_ns`."""

    def send(self, data: bytes, at_ns: int) -> None:
        """Send a message that the peer gets once it is granted `at_ns` or later."""

    def receive(self) -> list[tuple[int, bytes]]:
        """Return what has come since the last call, as (stamp in ns, message)."""


class Observer(Protocol):
    """Who is told how the loop goes."""

    def wait(self) -> None:
        """A grant is waited for."""

    def grant(self, k: int, granted_ns: int) -> None:
        """Interval `k` was granted."""


class Exchange:
    """One federate's side of the contract: numbered bundles, checked stamps, counted streams.

    The federates meet at the first instant t_k of each of the clock's strides, and at the end; each
    has one bundle from the other there, which has the meeting's number. Without a lead the
    network is granted t_k + 1 us and sends its bundle then; the grid, granted t_k + 2 us, has it at
    once and stamps its own bundle t_k+1, to which HELICS holds it. With a lead both are granted
    t_k + 1 us, work side by side, and stamp all that they send with the next meeting's instant.
    What has one stamp goes as one message, before the next grant is asked for.
    """

    def __init__(
        self,
        name: str,
        link: Link,
        clock: Clock,
        observer: Observer | None = None,
    ) -> None:
        self._name = name
        self._link = link
        self._clock = clock
        self._observer = observer
        self._arrived: dict[tuple[Kind, int], list[Part]] = {}
        self._unsent: list[bytes] = []
        self._unsent_ns = 0
        self.sent = Ledger()
        self.received = Ledger()

    def meet(self, k: int) -> None:
        """Wait for the grant of the meeting at t_k.

        Raises:
            TimeContractBroken: another time was granted than asked for.
        """
        self._flush()
        asked_ns = self._clock.at_ns(k) + lag_ns(self._name, self._clock)
        if self._observer is not None:
            self._observer.wait()
        granted_ns = self._link.request(asked_ns)
        if granted_ns != asked_ns:
            raise TimeContractBroken(
                f"{self._name} asked for {ns_to_seconds(asked_ns):.9f} s "
                f"and was granted {ns_to_seconds(granted_ns):.9f} s"
            )
        self._collect(k)
        if self._observer is not None:
            self._observer.grant(k, granted_ns)

    def send(self, k: int, payload: bytes) -> None:
        """Send bundle `k`, which the peer has at the meeting at t_k."""
        self.sent.add(payload)
        self._send(Kind.BUNDLE, k, payload)

    def receive(self, k: int) -> bytes:
        """Return the peer's bundle `k`.

        Raises:
            TimeContractBroken: it has not come.
            CosimError: a part of it is missing.
        """
        payload = self._take(Kind.BUNDLE, k)
        self.received.add(payload)
        return payload

    def send_end(self) -> None:
        """Tell the peer how much was sent, and its hash, at the last meeting."""
        self._send(Kind.END, self._clock.intervals, self.sent.to_bytes())
        self._flush()

    def check_end(self) -> None:
        """Compare the peer's end marker with what came.

        Raises:
            CosimError: counts or hashes differ, or something came that nobody took.
        """
        self.received.check(self._take(Kind.END, self._clock.intervals), PEER[self._name])
        if self._arrived:
            left = ", ".join(f"{kind.name.lower()} {k}" for kind, k in self._arrived)
            raise CosimError(f"{self._name} was sent more than the contract knows: {left}")

    def _stamp_ns(self, sender: str, meeting: int) -> int:
        answers_at_once = sender == NETWORK and not self._clock.lead
        lag = lag_ns(sender, self._clock) if answers_at_once else 0
        return self._clock.at_ns(meeting) + lag

    def _send(self, kind: Kind, k: int, payload: bytes) -> None:
        at_ns = self._stamp_ns(self._name, k)
        if at_ns != self._unsent_ns:
            self._flush()
        self._unsent_ns = at_ns
        self._unsent += split(kind, k, payload, self._link.limit_bytes)

    def _flush(self) -> None:
        for message in put_together(self._unsent, self._link.limit_bytes):
            self._link.send(message, self._unsent_ns)
        self._unsent.clear()

    def _collect(self, meeting: int) -> None:
        expected_ns = self._stamp_ns(PEER[self._name], meeting)
        for stamp_ns, data in self._link.receive():
            for part in read_parts(data):
                if stamp_ns != expected_ns or part.k != meeting:
                    raise TimeContractBroken(
                        f"{self._name} in interval {meeting}: {PEER[self._name]}'s "
                        f"{part.kind.name.lower()} {part.k} came stamped {stamp_ns} ns, "
                        f"the contract says {meeting} at {expected_ns} ns"
                    )
                self._arrived.setdefault((part.kind, part.k), []).append(part)

    def _take(self, kind: Kind, k: int) -> bytes:
        parts = self._arrived.pop((kind, k), None)
        if parts is None:
            what = f"{PEER[self._name]}'s {kind.name.lower()} {k}"
            raise TimeContractBroken(f"{self._name} in interval {k}: {what} is missing")
        return join(parts)


def run_grid(grid: Participant, exchange: Exchange, clock: Clock) -> None:
    """Take the grid through every stride, up to the checked end marker."""
    [frames] = grid.start()
    exchange.send(0, frames)
    for k in clock.meetings():
        exchange.meet(k)
        exchange.send(clock.next_meeting(k), grid.advance(k, exchange.receive(k)))
    exchange.send_end()
    exchange.meet(clock.intervals)
    exchange.check_end()


def run_network(network: Participant, exchange: Exchange, clock: Clock) -> None:
    """Take the network through every stride, up to the checked end marker.

    Raises:
        CosimError: the network's first deliveries are not those of its lead.
    """
    for deliveries in first_deliveries(network, clock):
        exchange.send(0, deliveries)
    for k in clock.meetings():
        exchange.meet(k)
        deliveries = network.advance(k, exchange.receive(k))
        due = clock.next_meeting(k) if clock.lead else k
        if due < clock.intervals:
            exchange.send(due, deliveries)
    if clock.lead:
        exchange.send_end()
    exchange.meet(clock.intervals)
    network.advance(clock.intervals, exchange.receive(clock.intervals))
    exchange.check_end()
    if not clock.lead:
        exchange.send_end()


def first_deliveries(network: Participant, clock: Clock) -> list[bytes]:
    """Return the message that a network with a lead can tell before it was given a frame.

    Raises:
        CosimError: they are not those of the clock's lead.
    """
    first = network.start()
    if len(first) != (1 if clock.lead else 0):
        raise CosimError(
            f"the network's lead is {clock.lead} intervals, but it began with {len(first)} messages"
        )
    return first


SIDES: dict[str, Callable[[Participant, Exchange, Clock], None]] = {
    GRID: run_grid,
    NETWORK: run_network,
}
