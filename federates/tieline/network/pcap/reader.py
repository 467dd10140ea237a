"""Reads when packets were captured and how large they were, for traffic that is played back."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.errors import InputError
from tieline.network.pcap.writer import (
    FILE_HEADER,
    LINKTYPE_ETHERNET,
    MAGIC_NS,
    MAGIC_US,
    RECORD_HEADER,
)
from tieline.units import NS_PER_S

LINKTYPE_PPP, LINKTYPE_PPP_HDLC = 9, 50
LINKTYPES_RAW = (12, 14, 101, 228, 229)
"""Link types of tcpdump.org: PPP with or without FF 03 before it, and packets without a header."""

_MAGIC_PCAPNG = bytes.fromhex("0a0d0d0a")
_VLAN_TAGS = (0x8100, 0x88A8, 0x9100)
_ETHERNET_IP = (0x0800, 0x86DD)
_PPP_FLAGS, _PPP_IP = 0xFF03, (0x0021, 0x0057)
_IPV6_HEADER_BYTES = 40
_LENGTHS_END = 6
_FIRST_RECORD = FILE_HEADER.itemsize
_HEADER_BYTES = RECORD_HEADER.itemsize

Bytes = NDArray[np.uint8]
Numbers = NDArray[np.int64]
ByteOrder = Literal["<", ">"]

_BYTE_ORDERS: tuple[ByteOrder, ...] = ("<", ">")


@dataclass(frozen=True)
class PacketTrace:
    """The IPv4 and IPv6 packets of a capture.

    Attributes:
        times_ns: (n,) ascending, ns since the first of them.
        sizes_bytes: (n,) from the IP header on, whatever part of the packet was captured.
        others: how many records were neither (ARP, LLDP, ...) and are left out.
    """

    times_ns: NDArray[np.int64]
    sizes_bytes: NDArray[np.int64]
    others: int


def read_pcap(path: Path) -> PacketTrace:
    """Return the IP packets of a classic pcap file.

    Both byte orders, micro- and nanoseconds; Ethernet (with VLAN tags), PPP and raw IP. A length of
    0 in the IP header, which segmentation in a network card leaves there, gives way to that of the
    record.

    Raises:
        InputError: the file cannot be read, is another format (pcapng too) or another link type, is
            cut off, holds no IP packet, goes back in time, or captured too little of a packet.
    """
    data = _bytes_of(path)
    order, ns_per_tick, link_type = _layout(path, data)
    offsets, end = _offsets(data, order == ">")
    if end != len(data):
        raise InputError(
            f"{path}: record {len(offsets) + 1} is cut off: the file ends at byte {len(data)}"
        )
    rows = np.lib.stride_tricks.sliding_window_view(data, _HEADER_BYTES)[offsets]
    headers = rows.view(RECORD_HEADER.newbyteorder(order)).reshape(len(offsets))
    times_ns = _times_ns(path, headers, ns_per_tick)
    captured = headers["captured_bytes"].astype(np.int64)
    starts, is_ip = _ip_starts(data, offsets + _HEADER_BYTES, captured, link_type)
    if not is_ip.any():
        raise InputError(f"{path}: none of its {len(offsets)} records is an IPv4 or IPv6 packet")
    _check_captured(path, starts, captured, is_ip)
    whole = headers["bytes"].astype(np.int64) - starts
    sizes = _sizes(data, offsets + _HEADER_BYTES + starts, whole)
    packets_ns = times_ns[is_ip]
    return PacketTrace(packets_ns - packets_ns[0], sizes[is_ip], int((~is_ip).sum()))


def _bytes_of(path: Path) -> Bytes:
    """Return the file's bytes, which the operating system fetches as they are used."""
    try:
        if path.stat().st_size < FILE_HEADER.itemsize:
            raise InputError(f"{path}: shorter than the {FILE_HEADER.itemsize} bytes of a header")
        return np.asarray(np.memmap(path, np.uint8, "r"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


def _layout(path: Path, data: Bytes) -> tuple[ByteOrder, int, int]:
    """Return (byte order, ns a tick, link type) of a file."""
    first = data[: FILE_HEADER.itemsize].tobytes()
    for order in _BYTE_ORDERS:
        header = np.frombuffer(first, FILE_HEADER.newbyteorder(order))[0]
        if header["magic"] in (MAGIC_NS, MAGIC_US):
            # The upper bits say how many bytes of a frame check follow each frame.
            link_type = int(header["link_type"]) & 0xFFFF
            if link_type not in (
                LINKTYPE_ETHERNET,
                LINKTYPE_PPP,
                LINKTYPE_PPP_HDLC,
                *LINKTYPES_RAW,
            ):
                raise InputError(
                    f"{path}: link type {link_type} is not known; Ethernet (1), PPP (9, 50) and "
                    "raw IP (12, 14, 101, 228, 229) are"
                )
            return order, 1 if header["magic"] == MAGIC_NS else 1000, link_type
    if first.startswith(_MAGIC_PCAPNG):
        raise InputError(
            f"{path}: is a pcapng file; convert it: editcap -F nsecpcap {path.name} new.pcap"
        )
    raise InputError(f"{path}: is no pcap file: it begins with 0x{first[:4].hex()}")


@compiled
def _offsets(data: Bytes, is_big_endian: bool) -> tuple[Numbers, int]:
    """Return where each whole record begins (n,), and where the last one ends."""
    count = 0
    offsets = np.empty(1024, np.int64)
    at = _FIRST_RECORD
    while at + _HEADER_BYTES <= len(data):
        size = 0
        for place in range(4):
            size = 256 * size + int(data[at + 8 + (place if is_big_endian else 3 - place)])
        if at + _HEADER_BYTES + size > len(data):
            break
        if count == len(offsets):
            offsets = np.concatenate((offsets, np.empty(count, np.int64)))
        offsets[count] = at
        count += 1
        at += _HEADER_BYTES + size
    return offsets[:count], at


def _times_ns(path: Path, headers: NDArray[np.void], ns_per_tick: int) -> Numbers:
    """Return the times (n,) of records, ns since 1970-01-01 UTC."""
    fraction_ns = headers["fraction"].astype(np.int64) * ns_per_tick
    for record in np.flatnonzero(fraction_ns >= NS_PER_S)[:1]:
        raise InputError(
            f"{path}: record {record + 1} has a fraction of {fraction_ns[record]} ns, which is "
            "more than a second"
        )
    times_ns = headers["seconds"].astype(np.int64) * NS_PER_S + fraction_ns
    back_ns = -np.diff(times_ns)
    for record in np.flatnonzero(back_ns > 0)[:1]:
        raise InputError(
            f"{path}: record {record + 2} is {back_ns[record]} ns before the one ahead of it; sort "
            f"the file: reordercap {path.name} new.pcap"
        )
    return times_ns


def _ip_starts(
    data: Bytes, frames: Numbers, captured: Numbers, link_type: int
) -> tuple[Numbers, NDArray[np.bool_]]:
    """Return where IP begins (n,) in frames that begin at bytes (n,), and if it is IP at all."""
    starts = np.zeros(len(frames), np.int64)
    if link_type == LINKTYPE_ETHERNET:
        starts += 12
        while (
            is_tag := _is_in(data, frames + starts, _VLAN_TAGS) & (starts + 6 <= captured)
        ).any():
            starts[is_tag] += 4
        is_ip = _is_in(data, frames + starts, _ETHERNET_IP)
        starts += 2
    elif link_type in (LINKTYPE_PPP, LINKTYPE_PPP_HDLC):
        starts[_is_in(data, frames, (_PPP_FLAGS,))] = 2
        is_ip = _is_in(data, frames + starts, _PPP_IP)
        starts += 2
    else:
        is_ip = np.ones(len(frames), np.bool_)
    version = data.take(frames + starts, mode="clip") >> 4
    return starts, is_ip & (starts < captured) & np.isin(version, (4, 6))


def _check_captured(
    path: Path, starts: Numbers, captured: Numbers, is_ip: NDArray[np.bool_]
) -> None:
    for record in np.flatnonzero(is_ip & (starts + _LENGTHS_END > captured))[:1]:
        raise InputError(
            f"{path}: record {record + 1} holds {captured[record]} bytes of its frame: too few for "
            "the length in the IP header"
        )


def _sizes(data: Bytes, packets: Numbers, whole: Numbers) -> Numbers:
    """Return the sizes (n,) of IP packets that begin at bytes (n,); `whole` where IP says 0."""
    is_ipv6 = data.take(packets, mode="clip") >> 4 == 6
    stated = _words(data, packets + np.where(is_ipv6, 4, 2))
    return np.where(stated > 0, stated + is_ipv6 * _IPV6_HEADER_BYTES, whole)


def _words(data: Bytes, places: Numbers) -> Numbers:
    """Return the 16-bit words (n,) in network byte order at bytes (n,)."""
    high, low = (data.take(places + at, mode="clip").astype(np.int64) for at in (0, 1))
    return high << 8 | low


def _is_in(data: Bytes, places: Numbers, words: tuple[int, ...]) -> NDArray[np.bool_]:
    return np.isin(_words(data, places), words)
