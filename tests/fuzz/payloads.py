"""What comes over HELICS: parts of bundles, bundles, end markers, signals of guests."""

import functools
from collections.abc import Sequence

import numpy as np

from fuzz.script import Script, edited
from tieline.cosim.border import DeliveryBorder
from tieline.cosim.desks import GridDesk
from tieline.cosim.exchange import Exchange, run_grid, run_network
from tieline.cosim.guests import Command, GuestSettings, endpoint_of
from tieline.cosim.interfaces import (
    DELIVERY,
    GRID,
    NETWORK,
    Clock,
    DeliveryBundle,
    FrameBundle,
    lag_ns,
)
from tieline.cosim.strangers import Strangers
from tieline.cosim.wire import Kind, Ledger, join, put_together, read_parts, split
from tieline.errors import CosimError, NumericalError

CLOCK = Clock(60, 4)
DAMPER = GuestSettings(name="damper", command="damper", units=("G2",))


def one_input(data: bytes) -> None:
    """Read what an input makes of a message."""
    script = Script(data)
    reader = script.one([_parts, _frames, _deliveries, _end, _signals, _exchange])
    try:
        reader(script)
    except (CosimError, NumericalError) as error:
        assert len(str(error)) < 2_000


def _parts(script: Script) -> None:
    limit = script.one([None, 40, 200])
    messages = split(Kind(script.below(2)), script.below(100), _bundle(), limit)
    spoilt = [edited(message, script) if script.below(3) else message for message in messages]
    together = put_together(spoilt, limit)
    join([part for message in together for part in read_parts(message)])


def _frames(script: Script) -> None:
    whole = FrameBundle(16_666_666, np.arange(68, dtype=np.uint8).reshape(2, 34)).to_bytes()
    message = script.rest() if script.below(6) == 0 else edited(whole, script)
    bundle = FrameBundle.from_bytes(message)
    assert bundle.to_bytes() == message


def _deliveries(script: Script) -> None:
    message = script.rest() if script.below(6) == 0 else edited(_bundle(), script)
    bundle = DeliveryBundle.from_bytes(message)
    assert bundle.to_bytes() == message
    assert (bundle.records["payload"] < len(bundle.payloads)).all()
    border = DeliveryBorder(CLOCK, 2, 2)
    border.check(0, DeliveryBundle(CLOCK.at_ns(1), np.empty(0, DELIVERY), bundle.payloads))
    border.check(1, bundle)
    arrivals_ns = bundle.records["arrival_ns"]
    assert (np.diff(arrivals_ns) >= 0).all()
    assert ((arrivals_ns >= CLOCK.at_ns(1)) & (arrivals_ns <= CLOCK.at_ns(2))).all()


def _end(script: Script) -> None:
    ledger = Ledger()
    ledger.add(b"x")
    ledger.check(edited(ledger.to_bytes(), script), "network")


def _signals(script: Script) -> None:
    """Hand a desk messages of a guest and of others; what it passes on must be the guest's own."""
    desk = GridDesk(_Obedient(), CLOCK, {"G2": DAMPER})
    port = _Port()
    strangers = Strangers(GRID, lambda line: None)
    desk.open(port, strangers)
    sources = [endpoint_of("damper", "G2"), "damper/G1", "x/any", ""]
    for k in range(2):
        for _ in script.rounds(3):
            text = script.rest() if script.below(6) == 0 else edited(b"0.0125", script)
            stamp_ns = CLOCK.at_ns(k) - 100 - script.below(20_000)
            port.coming.append((script.one(sources), stamp_ns, text))
        desk.advance(k, b"")


class _Obedient:
    """A grid that holds what it is told to be a number of its guest's."""

    name = GRID

    def start(self) -> list[bytes]:
        return []

    def advance(self, k: int, received: bytes) -> bytes:
        return b""

    def modulate(self, k: int, commands: Sequence[Command]) -> None:
        for command in commands:
            assert command.unit == "G2"
            assert np.isfinite(command.v_s_pu)

    def finish(self) -> None: ...

    def abort(self, reason: str) -> None: ...


class _Port:
    """An endpoint at which the fuzzer's messages come."""

    def __init__(self) -> None:
        self.coming: list[tuple[str, int, bytes]] = []

    def endpoint(self, name: str) -> "_Port":
        return self

    def send(self, to: str, data: bytes, at_ns: int) -> None: ...

    def receive(self) -> list[tuple[str, int, bytes]]:
        coming, self.coming = self.coming, []
        return coming


def _exchange(script: Script) -> None:
    """Take one side through a run in which the peer's messages are spoilt, lost or repeated."""
    name = script.one([GRID, NETWORK])
    link = _Link(name, script)
    exchange = Exchange(name, link, CLOCK)
    side = _Plain(name)
    run_grid(side, exchange, CLOCK) if name == GRID else run_network(side, exchange, CLOCK)
    assert not link.is_spoilt, "a spoilt run came to its end"


class _Plain(_Obedient):
    """A side whose every message is the same."""

    def __init__(self, name: str) -> None:
        self.name = name

    def start(self) -> list[bytes]:
        return [b"x"] if self.name == GRID else []

    def advance(self, k: int, received: bytes) -> bytes:
        return b"x"


class _Link:
    """Grants what is asked, and hands over what a sound peer sends, but for what a script does."""

    limit_bytes: int | None = None

    def __init__(self, name: str, script: Script) -> None:
        self.is_spoilt = False
        self._name = name
        self._script = script
        self._k = -1
        self._sent = Ledger()

    def request(self, at_ns: int) -> int:
        self._k += 1
        late_ns = (-1, 0, 0, 0, 0, 0, 1)[self._script.below(7)] if not self._script.is_over else 0
        self.is_spoilt |= late_ns != 0
        return at_ns + late_ns

    def send(self, data: bytes, at_ns: int) -> None: ...

    def receive(self) -> list[tuple[int, bytes]]:
        lag = lag_ns(NETWORK, CLOCK) if self._name == GRID else 0
        stamp_ns = CLOCK.at_ns(self._k) + lag
        messages = []
        if self._k < CLOCK.intervals or self._name == NETWORK:
            self._sent.add(b"x")
            messages += split(Kind.BUNDLE, self._k, b"x", None)
        if self._k == CLOCK.intervals:
            messages += split(Kind.END, self._k, self._sent.to_bytes(), None)
        return self._spoilt([(stamp_ns, message) for message in messages])

    def _spoilt(self, whole: list[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
        if self._script.is_over:
            return whole
        deed, coming = self._script.below(6), list(whole)
        at = self._script.below(len(coming))
        if deed == 0:
            del coming[at]
        elif deed == 1:
            coming.append(coming[at])
        elif deed == 2:
            coming[at] = (coming[at][0] + self._script.below(4) - 1, coming[at][1])
        elif deed == 3:
            coming[at] = (coming[at][0], edited(coming[at][1], self._script))
        self.is_spoilt |= coming != whole
        return coming


@functools.cache
def _bundle() -> bytes:
    records = np.zeros(3, DELIVERY)
    records["arrival_ns"] = (16_700_000, 16_700_000, 33_000_000)
    records["source"], records["destination"] = (0, 1, 1), (0, 0, 1)
    records["sequence"], records["payload"] = (1, 1, 1), (0, 1, 1)
    payloads = np.arange(68, dtype=np.uint8).reshape(2, 34)
    return DeliveryBundle(33_333_333, records, payloads).to_bytes()
