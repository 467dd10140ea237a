"""What crosses the border between the federates: names, clock, bundles, the participant's shape."""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from tieline.cosim.guests import GuestSettings, guest_problems
from tieline.errors import CosimError
from tieline.units import NS_PER_S, Seconds, tick_ns

GRID = "grid"
NETWORK = "network"
FEDERATES = (GRID, NETWORK)
ENDPOINTS = {GRID: "grid/bundle", NETWORK: "network/bundle"}

DELIVERY = np.dtype(
    [
        ("arrival_ns", "<i8"),
        ("source", "<u2"),
        ("destination", "<u2"),
        ("sequence", "<u4"),
        ("payload", "<u4"),
    ]
)
"""One packet handed to its controller; `payload` is a row of the bundle's payload table."""

# The word, the instant, how many payloads and of how many bytes, and how many records.
_FRAMES = struct.Struct("<4sqII")
_DELIVERIES = struct.Struct("<4sqIII")


class FederationSettings(BaseModel):
    """How the federates meet."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    core: Literal["zmq", "tcp", "inproc", "local"] = Field(
        "zmq",
        description=(
            "HELICS core; inproc keeps both federates in one process, local leaves HELICS out"
        ),
    )
    start_timeout: Seconds = Field(
        30.0, gt=0, le=3600, description="longest wait for a federate to join"
    )
    hang_timeout: Seconds = Field(
        6.0,
        gt=0,
        le=3600,
        description=(
            "longest wall time without a grant before a federate counts as hung; a run whose"
            " meetings take long, and in which somebody works, gets more by itself"
        ),
    )
    guests: tuple[GuestSettings, ...] = Field(
        (), description="federates of other people's that take part"
    )

    @model_validator(mode="after")
    def _fit_guests(self) -> Self:
        found = guest_problems(self.guests, self.core, FEDERATES)
        if found:
            raise ValueError("; ".join(found))
        return self


MOST_PER_MEETING = 10
"""Intervals between two meetings at most, however late frames come: a run must show that it goes
on."""


@dataclass(frozen=True)
class Clock:
    """The reporting intervals [t_k, t_k+1] of a run, t_k = k / rate, in whole nanoseconds.

    Attributes:
        rate_hz: intervals a second.
        intervals: how many there are.
        lead: by how many intervals the network is ahead: what arrives in [t_k, t_k+1] depends on
            the frames measured up to t_(k - lead) alone. With a lead, an odd number, the federates
            work at once.
    """

    rate_hz: int
    intervals: int
    lead: int = 0

    @property
    def stride(self) -> int:
        """Return the intervals between two meetings.

        From one meeting to the next the grid simulates one stride while the network works out the
        stride after it, with the frames that it got at the meeting; so it must lead by all but one
        of two strides.
        """
        return (self.lead + 1) // 2 or 1

    def at_ns(self, k: int) -> int:
        """Return t_k."""
        return tick_ns(k, self.rate_hz)

    def next_meeting(self, k: int) -> int:
        """Return the interval at whose begin the federates meet after the meeting at t_k.

        After the last stride, which may be a shorter one, they meet at the end of the last
        interval; from there on it is the same.
        """
        return min(k + self.stride, self.intervals)

    def meetings(self) -> range:
        """Return the intervals at whose begin the federates meet; the end is one meeting more."""
        return range(0, self.intervals, self.stride)


def lead_of(rate_hz: int, lookahead_ns: int | None) -> int:
    """Return the `Clock.lead` of a network in which no frame does anything for `lookahead_ns`.

    Then the frames of t_(k+1) do not matter before t_(k+lead+1); one nanosecond is spared because
    instants are rounded to whole ones. Without frames (None) the lead is as long as is allowed.
    """
    most = 2 * MOST_PER_MEETING - 1
    if lookahead_ns is None:
        return most
    longest = ((lookahead_ns - 1) * rate_hz - 1) // NS_PER_S
    return max(0, min(most, longest - (longest + 1) % 2))


def lag_ns(name: str, clock: Clock) -> int:
    """Return how long after t_k a federate is granted: together, or the grid after the network."""
    return 2_000 if name == GRID and not clock.lead else 1_000


class Participant(Protocol):
    """One federate seen from the federation: bytes in, bytes out, once a meeting."""

    name: str

    def start(self) -> list[bytes]:
        """Return the messages that the other federate needs before any went the other way.

        They are the grid's frames of t_0, and with a `Clock.lead` the network's deliveries of the
        first stride.
        """

    def advance(self, k: int, received: bytes) -> bytes:
        """Return one more message for the other federate, given its one for the meeting at t_k.

        The grid is given the deliveries of the stride that begins at t_k, and returns the frames
        that are measured until the next meeting, that instant included. The network is given those
        frames, up to t_k, and returns the deliveries of the stride that begins at t_k or, with a
        `Clock.lead`, at the next meeting; at the end of the run, where nothing is to come, b"".
        """

    def finish(self) -> None:
        """Write what is left to write; the federation has reached its end."""

    def abort(self, reason: str) -> None:
        """Save what there is; the federation ends early."""


OpenParticipant = Callable[[dict[str, Any], Path], Participant]
"""Makes a participant from the run file's content and the run folder."""


@dataclass(frozen=True)
class FrameBundle:
    """The frames measured at one instant: `payloads` (n, size) uint8, row i from source i."""

    measured_ns: int
    payloads: NDArray[np.uint8]

    def to_bytes(self) -> bytes:
        """Return the bundle as one message."""
        head = _FRAMES.pack(b"TLF1", self.measured_ns, *self.payloads.shape)
        return head + self.payloads.tobytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> "FrameBundle":
        """Return the bundle that a message holds.

        Raises:
            CosimError: the message is no frame bundle.
        """
        bundles = cls.several_from_bytes(data)
        if len(bundles) != 1:
            raise CosimError(f"expected the frames of one instant, got {len(bundles)}")
        return bundles[0]

    @classmethod
    def several_from_bytes(cls, data: bytes) -> list["FrameBundle"]:
        """Return the bundles that a message holds, one after another; at least one.

        Raises:
            CosimError: the message holds something else.
        """
        bundles: list[FrameBundle] = []
        at = 0
        while at < len(data) or not bundles:
            measured_ns, count, size = _head(data, _FRAMES, b"TLF1", at)
            at += _FRAMES.size + count * size
            if at > len(data):
                raise CosimError(f"a bundle of {at} bytes came with {len(data)}")
            payloads = np.frombuffer(data, np.uint8, count * size, at - count * size)
            bundles.append(cls(measured_ns, payloads.reshape(count, size)))
        return bundles


class Deliveries(NamedTuple):
    """The columns (m,) of `DELIVERY`, as whole numbers of one kind."""

    arrival_ns: NDArray[np.int64]
    source: NDArray[np.int64]
    destination: NDArray[np.int64]
    sequence: NDArray[np.int64]
    payload: NDArray[np.int64]


@dataclass(frozen=True)
class DeliveryBundle:
    """What arrives up to an instant: `records` (m,) of `DELIVERY`, `payloads` (n, size) uint8.

    The records are in the total order (arrival_ns, source, sequence, destination). A payload that
    reaches many controllers unchanged stands in the table once.
    """

    until_ns: int
    records: NDArray[np.void]
    payloads: NDArray[np.uint8]

    def to_bytes(self) -> bytes:
        """Return the bundle as one message."""
        shape = (*self.payloads.shape, len(self.records))
        head = _DELIVERIES.pack(b"TLD1", self.until_ns, *shape)
        return head + self.payloads.tobytes() + self.records.tobytes()

    @cached_property
    def columns(self) -> "Deliveries":
        """The records' columns, for compiled code."""
        return Deliveries(*(self.records[name].astype(np.int64) for name in Deliveries._fields))

    @classmethod
    def from_bytes(cls, data: bytes) -> "DeliveryBundle":
        """Return the bundle that a message holds.

        Raises:
            CosimError: the message is no delivery bundle, or a record names a payload it lacks.
        """
        until_ns, count, size, records = _head(data, _DELIVERIES, b"TLD1")
        start = _DELIVERIES.size + count * size
        _check_length(data, start + records * DELIVERY.itemsize)
        payloads = np.frombuffer(data, np.uint8, count * size, _DELIVERIES.size)
        table = np.frombuffer(data, DELIVERY, records, start)
        if records and int(table["payload"].max()) >= count:
            raise CosimError(f"a delivery names payload {table['payload'].max()} of {count}")
        return cls(until_ns, table, payloads.reshape(count, size))


def _head(data: bytes, layout: struct.Struct, magic: bytes, at: int = 0) -> tuple[int, ...]:
    """Return the numbers that a bundle begins with, at a place of a message."""
    begin = data[at : at + 8]
    if len(data) - at < layout.size or not begin.startswith(magic):
        raise CosimError(
            f"expected a {magic.decode()} bundle, got {len(data) - at} bytes {begin!r}"
        )
    _, *numbers = layout.unpack_from(data, at)
    return tuple(numbers)


def _check_length(data: bytes, expected: int) -> None:
    if len(data) != expected:
        raise CosimError(f"a bundle of {expected} bytes came with {len(data)}")
