"""Federates that other people write: what an experiment says of them, and how they are told."""

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StrictFloat

from tieline.errors import FrameError, NumericalError
from tieline.units import Unit, ns_to_seconds

MODULATION = "grid/modulation"
"""Endpoint of the grid that takes stabiliser signals."""
PACKETS = "network/packets"
"""Endpoint of the network that hands guests their packets, one message each."""

GUEST_LAG_NS = 3_000
"""How long after t_k a guest best asks to be granted: after the network and the grid."""

_LONGEST_SIGNAL_BYTES = 64
_PLACEHOLDERS = ("config", "name", "core", "broker", "port", "stop", "folder")


class GuestSettings(BaseModel):
    """A federate of somebody else's: what starts it, and what it may hear and say."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40)] = Field(
        description="the federate's name in HELICS"
    )
    command: str = Field(
        min_length=1,
        description=(
            "program and arguments, run in the experiment's folder; {config} stands for its HELICS"
            " file, {name} {core} {broker} {port} {stop} {folder} for single facts"
        ),
    )
    units: tuple[str, ...] = Field(
        (), description="units whose controllers' packets it gets and whose stabilisers it may move"
    )
    limit: Annotated[StrictFloat, Unit("pu")] = Field(
        0.1,
        gt=0,
        le=10,
        description="largest stabiliser signal either way; beyond it is clipped, pu",
    )

    def words(self, facts: Mapping[str, object]) -> list[str]:
        """Return the command, each placeholder replaced by its fact.

        Raises:
            ValueError: a placeholder is unknown, or a quotation does not end.
        """
        try:
            return [word.format_map(facts) for word in shlex.split(self.command)]
        except (KeyError, IndexError, AttributeError) as error:
            known = " ".join(f"{{{name}}}" for name in _PLACEHOLDERS)
            raise ValueError(f"unknown placeholder {error} (known: {known})") from error


def guest_problems(guests: Sequence[GuestSettings], core: str, members: Sequence[str]) -> list[str]:
    """Return what does not fit together among the guests of a federation."""
    found = []
    if guests and core not in ("zmq", "tcp"):
        found.append(
            f"guests need core zmq or tcp, as they are processes of their own (got {core})"
        )
    taken = [*members, "broker", "together"]
    owners: dict[str, str] = {}
    for guest in guests:
        if guest.name in taken:
            found.append(f"guests: the name {guest.name} is taken")
        taken.append(guest.name)
        for unit in guest.units:
            if unit in owners:
                found.append(f"guests: unit {unit} is named twice ({owners[unit]}, {guest.name})")
            owners[unit] = guest.name
        try:
            guest.words(dict.fromkeys(_PLACEHOLDERS, ""))
        except ValueError as error:
            found.append(f"guests: the command of {guest.name} cannot be used: {error}")
    return found


def endpoint_of(guest: str, unit: str) -> str:
    """Return the name of a guest's endpoint for a unit."""
    return f"{guest}/{unit}"


@dataclass(frozen=True)
class Command:
    """What a guest wants of a unit's stabiliser: a signal `v_s_pu`, sent at `stamp_ns`."""

    guest: str
    unit: str
    stamp_ns: int
    v_s_pu: float


def read_command(source: str, stamp_ns: int, data: bytes) -> Command:
    """Return what a message to `MODULATION` says: its text is a number, its source the unit.

    Raises:
        FrameError: the text is no number.
        NumericalError: the number is not finite.
    """
    guest, _, unit = source.partition("/")
    if len(data) > _LONGEST_SIGNAL_BYTES:
        raise FrameError(f"a stabiliser signal has at most {_LONGEST_SIGNAL_BYTES} bytes")
    try:
        v_s_pu = float(data.decode("ascii"))
    except (UnicodeDecodeError, ValueError):
        raise FrameError(
            "a stabiliser signal is a number as text, in pu, such as b'0.0125'"
        ) from None
    if not math.isfinite(v_s_pu):
        raise NumericalError(
            f"{guest} sent a stabiliser signal for {unit} that is not finite ({v_s_pu}) "
            f"at t = {ns_to_seconds(stamp_ns):.9f} s"
        )
    return Command(guest, unit, stamp_ns, v_s_pu)


def guests_of(run: Mapping[str, Any]) -> tuple[GuestSettings, ...]:
    """Return the guests of a run file."""
    stated = run["federation"].get("guests", ())
    return tuple(GuestSettings.model_validate(guest) for guest in stated)


def unit_owners(run: Mapping[str, Any]) -> dict[str, GuestSettings]:
    """Return who may move which unit's stabiliser."""
    return {unit: guest for guest in guests_of(run) for unit in guest.units}
