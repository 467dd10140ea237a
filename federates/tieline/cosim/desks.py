"""Where guests are served: the network's participant hands them packets, the grid's obeys them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from tieline.cosim.border import check_stamps
from tieline.cosim.guests import (
    MODULATION,
    PACKETS,
    Command,
    GuestSettings,
    endpoint_of,
    read_command,
    unit_owners,
)
from tieline.cosim.interfaces import GRID, NETWORK, Clock, DeliveryBundle, Participant, lag_ns
from tieline.cosim.strangers import Strangers
from tieline.errors import FrameError, TimeContractBroken
from tieline.units import ns_to_seconds


class Port(Protocol):
    """An endpoint beside the one for bundles."""

    def send(self, to: str, data: bytes, at_ns: int) -> None:
        """Send a message that comes at `at_ns`."""

    def receive(self) -> list[tuple[str, int, bytes]]:
        """Return what has come, as (source, stamp in ns, message)."""


class Ports(Protocol):
    """Who has such endpoints."""

    def endpoint(self, name: str) -> Port:
        """Return one by its name."""


class Modulated(Participant, Protocol):
    """A participant that obeys guests."""

    def modulate(self, k: int, commands: Sequence[Command]) -> None:
        """Let commands act from t_k on, in their order."""


class _Desk:
    """A participant with guests beside it; `open` comes before the first interval."""

    endpoint_name: str

    def __init__(self, participant: Participant) -> None:
        self.name = participant.name
        self._participant = participant
        self._port: Port
        self._strangers: Strangers

    def open(self, ports: Ports, strangers: Strangers) -> None:
        """Take the endpoint for guests from the federate's link, and who counts what is dropped."""
        self._port = ports.endpoint(self.endpoint_name)
        self._strangers = strangers

    def start(self) -> list[bytes]:
        """Return the participant's first messages."""
        return self._participant.start()

    def finish(self) -> None:
        """Let the participant finish."""
        self._participant.finish()

    def abort(self, reason: str) -> None:
        """Let the participant save what it has."""
        self._participant.abort(reason)


class NetworkDesk(_Desk):
    """The network: each packet of a guest's unit goes to the guest, stamped with its arrival.

    Args:
        participant: the network.
        clock: of the run; without a lead.
        endpoints: of guests, by the number of the controller whose packets they get.
    """

    endpoint_name = PACKETS

    def __init__(
        self, participant: Participant, clock: Clock, endpoints: Mapping[int, str]
    ) -> None:
        super().__init__(participant)
        self._clock = clock
        self._endpoints = endpoints

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the participant's bundle; its packets for guests are sent on their way.

        Raises:
            TimeContractBroken: a packet arrives outside the interval.
        """
        for source, _, data in self._port.receive():
            self._strangers.drop(PACKETS, source, data, "nobody may send there")
        message = self._participant.advance(k, received)
        if message:
            bundle = DeliveryBundle.from_bytes(message)
            check_stamps(NETWORK, self._clock, k, bundle.records["arrival_ns"])
            for record in bundle.records:
                to = self._endpoints.get(int(record["destination"]))
                if to is not None:
                    data = bundle.payloads[record["payload"]].tobytes()
                    self._port.send(to, data, int(record["arrival_ns"]))
        return message


class GridDesk(_Desk):
    """The grid: at its grant of t_k + 2 us it takes what guests have sent since the grant before.

    Args:
        participant: the grid.
        clock: of the run; without a lead.
        owners: which guest may move which unit.
    """

    endpoint_name = MODULATION

    def __init__(
        self, participant: Modulated, clock: Clock, owners: Mapping[str, GuestSettings]
    ) -> None:
        super().__init__(participant)
        self._grid = participant
        self._clock = clock
        self._known = {endpoint_of(owner.name, unit) for unit, owner in owners.items()}
        self._granted_ns = -1

    def advance(self, k: int, received: bytes) -> bytes:
        """Let the commands that came act from t_k on; return the participant's frames.

        Raises:
            TimeContractBroken: as `_check`.
            NumericalError: a guest's signal is not finite.
        """
        before_ns, self._granted_ns = self._granted_ns, self._clock.at_ns(k) + self._lag_ns
        commands = list(self._commands())
        for command in commands:
            self._check(command, before_ns)
        if commands:
            self._grid.modulate(k, sorted(commands, key=_order))
        return self._grid.advance(k, received)

    @property
    def _lag_ns(self) -> int:
        return lag_ns(GRID, self._clock)

    def _commands(self) -> Iterator[Command]:
        """Yield the signals of guests for their own units; all else is dropped and counted."""
        for source, stamp_ns, data in self._port.receive():
            if source not in self._known:
                why = "it is no guest, or the unit is not among its own"
                self._strangers.drop(MODULATION, source, data, why)
                continue
            try:
                yield read_command(source, stamp_ns, data)
            except FrameError as error:
                self._strangers.drop(MODULATION, source, data, str(error))

    def _check(self, command: Command, before_ns: int) -> None:
        """Refuse a command whose place among the grid's grants is left to chance.

        Raises:
            TimeContractBroken: it is.
        """
        if not before_ns < command.stamp_ns < self._granted_ns:
            raise TimeContractBroken(
                f"{command.guest} sent a signal for {command.unit} at "
                f"{ns_to_seconds(command.stamp_ns):.9f} s, the very instant of a grant of the "
                "grid: whether it comes in time would be left to chance; a guest asks for instants "
                "of its own, such as t_k + 3 us"
            )


def _order(command: Command) -> tuple[int, str]:
    return command.stamp_ns, command.unit


def desk_of(participant: Any, run: Mapping[str, Any]) -> NetworkDesk | GridDesk | None:
    """Return a run's participant with its guests beside it; None where no guest needs it."""
    owners = unit_owners(run)
    if not owners:
        return None
    if participant.name == NETWORK:
        units = [site["unit"] for site in run["destinations"]]
        places = {units.index(unit): endpoint_of(owners[unit].name, unit) for unit in owners}
        return NetworkDesk(participant, Clock(**run["clock"]), places)
    return GridDesk(participant, Clock(**run["clock"]), owners)
