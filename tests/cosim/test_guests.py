"""Guests at the hand-over: what reaches them, when they are heard, and what is refused."""

from collections.abc import Sequence

import numpy as np
import pytest
from pydantic import ValidationError

from tieline.cosim.conventions import guest_config, member_count
from tieline.cosim.desks import GridDesk, NetworkDesk, desk_of
from tieline.cosim.guests import Command, GuestSettings, read_command
from tieline.cosim.interfaces import (
    DELIVERY,
    Clock,
    DeliveryBundle,
    FederationSettings,
)
from tieline.cosim.runfile import federation_of
from tieline.cosim.strangers import Strangers
from tieline.errors import FrameError, NumericalError, TimeContractBroken

DAMPER = GuestSettings(name="damper", command="python damper.py {config}", units=("G2",))
CLOCK = Clock(60, 3)
RUN = {
    "clock": {"rate_hz": 60, "intervals": 3, "lead": 0},
    "federation": {"core": "zmq", "broker_port": 20_000, "guests": [DAMPER.model_dump()]},
    "sources": [{"name": "pmu00", "bus": 61}, {"name": "pmu01", "bus": 119}],
    "destinations": [{"name": "ctl00", "unit": "G1"}, {"name": "ctl01", "unit": "G2"}],
}


class Side:
    """A participant that answers with one message and notes what it is told."""

    def __init__(self, name: str, answer: bytes = b"") -> None:
        self.name = name
        self.log: list[object] = []
        self._answer = answer

    def start(self) -> list[bytes]:
        return []

    def advance(self, k: int, received: bytes) -> bytes:
        self.log.append(k)
        return self._answer

    def modulate(self, k: int, commands: Sequence[Command]) -> None:
        self.log.append([(command.unit, command.v_s_pu) for command in commands])

    def finish(self) -> None: ...

    def abort(self, reason: str) -> None: ...


class Mailbox:
    """The endpoint of a desk: what the test lays out comes, what is sent is kept."""

    def __init__(self) -> None:
        self.coming: list[tuple[str, int, bytes]] = []
        self.sent: list[tuple[str, bytes, int]] = []

    def endpoint(self, name: str) -> "Mailbox":
        return self

    def send(self, to: str, data: bytes, at_ns: int) -> None:
        self.sent.append((to, data, at_ns))

    def receive(self) -> list[tuple[str, int, bytes]]:
        coming, self.coming = self.coming, []
        return coming


def grid_desk(*messages: tuple[str, int, bytes]) -> tuple[GridDesk, Side]:
    side = Side("grid")
    desk = desk_of(side, RUN)
    assert isinstance(desk, GridDesk)
    mailbox = Mailbox()
    mailbox.coming = list(messages)
    desk.open(mailbox, Strangers("grid", lambda line: None))
    return desk, side


def test_a_guest_gets_the_packets_of_its_unit_with_their_arrivals_and_no_others() -> None:
    """A controller that saw packets early, late or of another unit would control another system."""
    records = np.zeros(3, DELIVERY)
    records["arrival_ns"], records["destination"] = (11, 12, 13), (1, 0, 1)
    records["payload"] = (0, 1, 1)
    frames = np.arange(6, dtype=np.uint8).reshape(2, 3)
    side = Side("network", DeliveryBundle(20, records, frames).to_bytes())
    desk, mailbox = desk_of(side, RUN), Mailbox()
    assert isinstance(desk, NetworkDesk)
    mailbox.coming = [("nobody/any", 5, b"noise")]
    strangers = Strangers("network", lambda line: None)
    desk.open(mailbox, strangers)
    bundle = desk.advance(0, b"")
    assert strangers.counts == {"network/packets": {"nobody/any": 1}}
    assert mailbox.sent == [("damper/G2", b"\0\1\2", 11), ("damper/G2", b"\3\4\5", 13)]
    np.testing.assert_array_equal(DeliveryBundle.from_bytes(bundle).records, records)


def test_signals_reach_the_grid_before_it_integrates_in_order_of_their_stamps() -> None:
    """The last word of a guest before an interval is the one that holds in it."""
    desk, side = grid_desk(("damper/G2", 1_500, b"0.25"), ("damper/G2", 300, b"-1e-3"))
    desk.advance(0, b"")
    assert side.log == [[("G2", -1e-3), ("G2", 0.25)], 0]


@pytest.mark.parametrize("stamp_ns", [2_000, 2_001])
def test_a_signal_at_the_grids_own_instant_breaks_the_contract(stamp_ns: int) -> None:
    """Whether it comes in time would depend on which computer is the faster one."""
    desk, _ = grid_desk(("damper/G2", stamp_ns, b"0"))
    with pytest.raises(TimeContractBroken, match=r"damper sent a signal for G2 at .* the very"):
        desk.advance(0, b"")


def test_a_signal_that_comes_an_interval_late_breaks_the_contract() -> None:
    """HELICS hands over late what was stamped at a grant that the grid already had."""
    desk, _ = grid_desk()
    desk.advance(0, b"")
    desk._port.coming = [("damper/G2", 2_000, b"0")]  # type: ignore[attr-defined]
    with pytest.raises(TimeContractBroken, match="left to chance"):
        desk.advance(1, b"")


@pytest.mark.parametrize("source", ["damper/G1", "other/G2", "damper", ""])
def test_nobody_moves_a_stabiliser_that_is_not_its_own(source: str) -> None:
    """A slip in a name would otherwise move another machine, or end the others' run."""
    desk, side = grid_desk((source, 300, b"0"))
    desk.advance(0, b"")
    assert side.log == [0]
    assert desk._strangers.counts == {"grid/modulation": {source: 1}}


@pytest.mark.parametrize("text", [b"", b"0.1 pu", b"\xff", b"1" * 65, b"0x1p3", b"\0"])
def test_a_signal_that_is_no_number_is_dropped_and_counted(text: bytes) -> None:
    """A machine must not be driven by what a parser makes of noise."""
    with pytest.raises(FrameError, match="a stabiliser signal"):
        read_command("damper/G2", 300, text)
    desk, side = grid_desk(("damper/G2", 300, text), ("damper/G2", 400, b"0.25"))
    desk.advance(0, b"")
    assert side.log == [[("G2", 0.25)], 0]
    assert desk._strangers.counts == {"grid/modulation": {"damper/G2": 1}}


@pytest.mark.parametrize("text", [b"nan", b"inf", b"-1e400"])
def test_a_signal_that_is_not_finite_ends_the_run_with_its_sender_and_time(text: bytes) -> None:
    """A guest's controller has failed; what it sends after that is worth nothing."""
    desk, _ = grid_desk(("damper/G2", 300, text))
    with pytest.raises(NumericalError, match=r"damper .* for G2 .* at t = 0\.000000300 s"):
        desk.advance(0, b"")


def test_a_federation_without_guests_with_units_has_no_desk() -> None:
    """What is not asked for must not be able to change a result."""
    alone = RUN | {"federation": {"core": "zmq"}}
    assert desk_of(Side("grid"), alone) is None
    assert member_count(alone) == 2
    assert member_count(RUN) == 3


def test_a_guests_file_says_where_to_meet_and_whom_it_hears() -> None:
    """A guest knows nothing of tieline but this file."""
    _, place = federation_of(RUN)
    config = guest_config(DAMPER, RUN, place, 30.0)
    assert config["name"] == "damper"
    assert config["uninterruptible"] is True
    assert "--brokerport=20000" in config["core_init_string"]
    assert config["endpoints"] == [
        {"name": "damper/G2", "global": True, "destination": "grid/modulation"}
    ]
    assert config["tieline"]["pmus"] == {"1": 61, "2": 119}
    assert config["tieline"]["stop_s"] == 0.05


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"core": "local", "guests": [DAMPER]}, "need core zmq or tcp"),
        ({"guests": [DAMPER, DAMPER]}, "the name damper is taken; guests: unit G2 is named twice"),
        ({"guests": [{"name": "grid", "command": "x"}]}, "the name grid is taken"),
        ({"guests": [{"name": "a", "command": "x {port} {prot}"}]}, "unknown placeholder 'prot'"),
        ({"guests": [{"name": "a", "command": "x 'y"}]}, "No closing quotation"),
        ({"guests": [{"name": "a", "command": "x", "limit": 0.0}]}, "greater than 0"),
    ],
)
def test_a_slip_in_the_guests_settings_is_refused(settings: dict, words: str) -> None:
    """It would otherwise show as a federation in which somebody never comes."""
    with pytest.raises(ValidationError, match=words):
        FederationSettings(**settings)
