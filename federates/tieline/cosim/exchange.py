"""The time loop: who is granted when, what is sent with which stamp, and what must have come."""

from collections.abc import Callable
from typing import Protocol

from tieline.cosim.interfaces import GRID, LAG_NS, NETWORK, Clock, Participant
from tieline.cosim.wire import Kind, Ledger, Part, join, read_part, split
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

    The network is granted t_k + 1 us and sends its bundle then; the grid is granted t_k + 2 us
    and stamps its bundle t_k+1, where HELICS holds it until the network's next grant.
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
        self.sent = Ledger()
        self.received = Ledger()

    def meet(self, k: int) -> None:
        """Wait for the grant of interval `k`.

        Raises:
            TimeContractBroken: another time was granted than asked for.
        """
        asked_ns = self._clock.at_ns(k) + LAG_NS[self._name]
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
        """Send bundle `k`: the grid's is stamped t_k, the network's with its grant."""
        self.sent.add(payload)
        self._send(Kind.BUNDLE, k, payload, self._stamp_ns(self._name, k))

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
        """Tell the peer how much was sent, and its hash."""
        last = self._clock.intervals
        self._send(Kind.END, last, self.sent.to_bytes(), self._stamp_ns(self._name, last))

    def check_end(self) -> None:
        """Compare the peer's end marker with what came.

        Raises:
            CosimError: counts or hashes differ, or something came that nobody took.
        """
        self.received.check(self._take(Kind.END, self._clock.intervals), PEER[self._name])
        if self._arrived:
            left = ", ".join(f"{kind.name.lower()} {k}" for kind, k in self._arrived)
            raise CosimError(f"{self._name} was sent more than the contract knows: {left}")

    def _stamp_ns(self, sender: str, k: int) -> int:
        return self._clock.at_ns(k) + (LAG_NS[NETWORK] if sender == NETWORK else 0)

    def _send(self, kind: Kind, k: int, payload: bytes, at_ns: int) -> None:
        for message in split(kind, k, payload, self._link.limit_bytes):
            self._link.send(message, at_ns)

    def _collect(self, k: int) -> None:
        expected_ns = self._stamp_ns(PEER[self._name], k)
        for stamp_ns, data in self._link.receive():
            part = read_part(data)
            if stamp_ns != expected_ns or part.k != k:
                raise TimeContractBroken(
                    f"{self._name} in interval {k}: {PEER[self._name]}'s {part.kind.name.lower()} "
                    f"{part.k} came stamped {stamp_ns} ns, the contract says {expected_ns} ns"
                )
            self._arrived.setdefault((part.kind, part.k), []).append(part)

    def _take(self, kind: Kind, k: int) -> bytes:
        parts = self._arrived.pop((kind, k), None)
        if parts is None:
            what = f"{PEER[self._name]}'s {kind.name.lower()} {k}"
            raise TimeContractBroken(f"{self._name} in interval {k}: {what} is missing")
        return join(parts)


def run_grid(grid: Participant, exchange: Exchange, clock: Clock) -> None:
    """Take the grid through every interval, up to the checked end marker."""
    exchange.send(0, grid.start())
    for k in range(clock.intervals):
        exchange.meet(k)
        exchange.send(k + 1, grid.advance(k, exchange.receive(k)))
    exchange.send_end()
    exchange.meet(clock.intervals)
    exchange.check_end()


def run_network(network: Participant, exchange: Exchange, clock: Clock) -> None:
    """Take the network through every interval, up to the checked end marker.

    Raises:
        CosimError: the network has something to say before it was given a frame.
    """
    check_silent(network.start())
    for k in range(clock.intervals):
        exchange.meet(k)
        exchange.send(k, network.advance(k, exchange.receive(k)))
    exchange.meet(clock.intervals)
    # The frames measured at the last instant reach nobody, but they count in the stream.
    exchange.receive(clock.intervals)
    exchange.check_end()
    exchange.send_end()


def check_silent(message: bytes) -> None:
    """Refuse a network that sends something before t_0.

    Raises:
        CosimError: the message is not empty.
    """
    if message:
        raise CosimError(
            f"the network's message before t_0 must be empty (got {len(message)} bytes)"
        )


SIDES: dict[str, Callable[[Participant, Exchange, Clock], None]] = {
    GRID: run_grid,
    NETWORK: run_network,
}
