"""Turns records of packets on a link into the bytes of their Ethernet frames."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError, InputError
from tieline.network.pcap.addresses import TCP, AddressPlan, mac_bytes
from tieline.network.pcap.headers import (
    DONT_FRAGMENT,
    IPV4,
    MORE_FRAGMENTS,
    TCP_HEADER,
    UDP_HEADER,
    ethernet_frames,
    ipv4_packets,
    target_mac,
    tcp_segments,
    udp_datagrams,
)
from tieline.network.pcap.writer import Group
from tieline.network.spec import NetworkSpec

FIRST_TTL = 255

_MOST_BYTES = 0xFFFF - IPV4.itemsize

PayloadOf = Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.uint8]]
"""Returns the frames (n, size) of sources (n,) with sequence numbers (n,)."""


class _Shape(NamedTuple):
    """What packets of one size have in common: bytes `first` to `end` - 1 of `whole` after IPv4."""

    is_pmu: int
    is_tcp: int
    whole: int
    first: int
    end: int


class LinkFrames:
    """The Ethernet frames of one link.

    Args:
        spec: the network.
        plan: its addresses.
        link: number of the link in `spec.links`.

    Raises:
        InputError: the link is not there, or the plan holds what no header can carry.
    """

    def __init__(self, spec: NetworkSpec, plan: AddressPlan, link: int) -> None:
        if not 0 <= link < len(spec.links):
            raise InputError(f"a capture needs a link 0 to {len(spec.links) - 1} (got {link})")
        plan.check()
        self._plan = plan
        self._source_of = np.array([flow.source for flow in spec.flows], dtype=np.int64)
        self._first_port = 2 * link
        numbers = {node.name: number for number, node in enumerate(spec.nodes)}
        self._ends = plan.nodes[[numbers[spec.links[link].a], numbers[spec.links[link].b]]]
        self._macs = mac_bytes(self._ends)

    def check(self, records: NDArray[np.void]) -> None:
        """Raise CosimError if a record is of another link or of no flow, or its TTL has run out."""
        for name, is_right in (
            ("port", np.isin(records["port"], (self._first_port, self._first_port + 1))),
            ("flow", (records["flow"] >= 0) & (records["flow"] < len(self._plan.flows))),
            ("hop", (records["hop"] >= 0) & (records["hop"] < FIRST_TTL - 1)),
        ):
            if not is_right.all():
                wrong = records[~is_right][0]
                raise CosimError(
                    f"a capture of ports {self._first_port} and {self._first_port + 1} got a "
                    f"packet with {name} {wrong[name]}: {wrong}"
                )

    def data(self, records: NDArray[np.void], payload_of: PayloadOf) -> list[Group]:
        """Return the frames of packets; the places are those of their records.

        Raises:
            CosimError: a packet's bytes are not those that its flow's payload and fragments give.
        """
        shapes = self._shapes(records)
        # One number for each shape: sorting rows would take half of the time. Sizes have 16 bits.
        keys = shapes @ (1 << np.array([49, 48, 32, 16, 0]))
        _, examples, which = np.unique(keys, return_index=True, return_inverse=True)
        groups = []
        for number, example in enumerate(examples):
            places = np.flatnonzero(which == number)
            shape = _Shape(*shapes[example].tolist())
            own = records[places]
            payload = self._payload(own, shape, payload_of)
            begins = 1 + own["sequence"].astype(np.int64) * payload.shape[1]
            groups.append(Group(places, self._frames(own, payload, begins, shape)))
        return groups

    def ahead(self, records: NDArray[np.void], payload: NDArray[np.uint8]) -> list[Group]:
        """Return frames that bring payloads (n, size) just before the packets of PMU flows.

        Such a frame has the IPv4 identification before the packet's, and over TCP its last byte is
        the one before the segment's first.
        """
        flows = self._plan.flows[records["flow"]]
        begins = 1 + records["sequence"].astype(np.int64) * flows["payload_bytes"]
        begins -= payload.shape[1]
        before = records.copy()
        before["sequence"] -= 1
        groups = []
        for is_tcp in (0, 1):
            places = np.flatnonzero((flows["protocol"] == TCP) == is_tcp)
            whole = _header_bytes(is_tcp) + payload.shape[1]
            shape = _Shape(1, is_tcp, whole, 0, whole)
            frames = self._frames(before[places], payload[places], begins[places], shape)
            groups.append(Group(places, frames))
        return groups

    def _shapes(self, records: NDArray[np.void]) -> NDArray[np.int64]:
        """Return the columns (n, 5) of `_Shape`."""
        flows = self._plan.flows[records["flow"]]
        piece = records["bytes"].astype(np.int64) - IPV4.itemsize
        # Replies and acknowledgements are never fragmented, and as large as they are.
        most = np.where(records["is_back"], 0, flows["fragment_bytes"].astype(np.int64))
        is_tcp = flows["protocol"] == TCP
        header = np.where(is_tcp, _header_bytes(True), _header_bytes(False))
        whole = np.where(most > 0, header + flows["payload_bytes"], piece)
        first = records["part"] * most
        # A packet that is never fragmented has one part, its whole.
        end = np.minimum(np.where(most > 0, first + most, whole), whole)
        is_wrong = (end - first != piece) | (piece < 1) | (whole < header) | (whole > _MOST_BYTES)
        is_wrong |= (most == 0) & (records["part"] != 0)
        if is_wrong.any():
            at = np.flatnonzero(is_wrong)[0]
            raise CosimError(
                f"a captured packet does not fit its flow, which sends "
                f"{flows['payload_bytes'][at]} bytes in fragments of {most[at]} (0: none): "
                f"{records[at]}"
            )
        is_pmu = (records["flow"] < self._plan.pmu_flows) & (records["is_back"] == 0)
        return np.column_stack([is_pmu, is_tcp, whole, first, end]).astype(np.int64)

    def _payload(
        self, records: NDArray[np.void], shape: _Shape, payload_of: PayloadOf
    ) -> NDArray[np.uint8]:
        expected = (len(records), shape.whole - _header_bytes(shape.is_tcp))
        if not shape.is_pmu:
            return np.zeros(expected, np.uint8)
        sequences = records["sequence"].astype(np.int64)
        payload = payload_of(self._source_of[records["flow"]], sequences)
        if payload.shape != expected:
            raise CosimError(
                f"a capture needs {expected[0]} PMU frames of {expected[1]} bytes, as large as "
                f"their packets (got {payload.shape})"
            )
        return payload

    def _frames(
        self,
        records: NDArray[np.void],
        payload: NDArray[np.uint8],
        begins: NDArray[np.int64],
        shape: _Shape,
    ) -> NDArray[np.uint8]:
        """Return frames (n, size); `begins` (n,) are the numbers of the first bytes over TCP."""
        flows = self._plan.flows[records["flow"]]
        back = records["is_back"] == 1
        ends = _either(back, flows["source_ip"], flows["target_ip"])
        sockets = (*ends, *_either(back, flows["source_port"], flows["target_port"]))
        if shape.is_tcp:
            whole = tcp_segments(payload, *sockets, begins)
        else:
            whole = udp_datagrams(payload, *sockets)
        more = MORE_FRAGMENTS if shape.end < shape.whole else 0
        packets = ipv4_packets(
            whole[:, shape.first : shape.end],
            *ends,
            flows["protocol"],
            ttl=FIRST_TTL - 1 - records["hop"],
            identification=records["sequence"],
            dscp=flows["dscp"],
            flags=np.where(flows["fragment_bytes"] > 0, more, DONT_FRAGMENT),
            offset_bytes=shape.first,
        )
        is_back = records["port"] - self._first_port
        to = target_mac(ends[1], self._ends[1 - is_back])
        return ethernet_frames(packets, self._macs[is_back], to)


def _either(
    is_back: NDArray[np.bool_], source: NDArray[Any], target: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return source and target of packets, of which some go back."""
    return np.where(is_back, target, source), np.where(is_back, source, target)


def _header_bytes(is_tcp: int) -> int:
    return TCP_HEADER.itemsize if is_tcp else UDP_HEADER.itemsize
