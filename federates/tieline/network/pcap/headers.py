"""Ethernet, IPv4, UDP and TCP headers for many packets of one size at once.

Every function takes payloads (n, size) uint8 and returns (n, size + header) uint8; any other
argument is (n,) or one value for all.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tieline.errors import InputError
from tieline.network.pcap.addresses import TCP, UDP, mac_bytes

ETHERNET = np.dtype([("target", "u1", 6), ("source", "u1", 6), ("type", ">u2")])
"""Ethernet II (IEEE Std 802.3, type interpretation), without preamble and frame check."""

IPV4 = np.dtype(
    [
        ("version_length", "u1"),
        ("dscp_ecn", "u1"),
        ("total_bytes", ">u2"),
        ("identification", ">u2"),
        ("flags_offset", ">u2"),
        ("ttl", "u1"),
        ("protocol", "u1"),
        ("checksum", ">u2"),
        ("source", ">u4"),
        ("target", ">u4"),
    ]
)
"""IPv4 without options (RFC 791; DSCP by RFC 2474)."""

UDP_HEADER = np.dtype([("source", ">u2"), ("target", ">u2"), ("bytes", ">u2"), ("checksum", ">u2")])
"""UDP (RFC 768)."""

TCP_HEADER = np.dtype(
    [
        ("source", ">u2"),
        ("target", ">u2"),
        ("sequence", ">u4"),
        ("acknowledgement", ">u4"),
        ("words", "u1"),
        ("flags", "u1"),
        ("window", ">u2"),
        ("checksum", ">u2"),
        ("urgent", ">u2"),
    ]
)
"""TCP without options (RFC 9293)."""

MORE_FRAGMENTS, DONT_FRAGMENT = 0x2000, 0x4000
"""Flags of IPv4, in the word of the fragment's offset."""

ACK, PSH = 0x10, 0x08
"""Flags of TCP."""

_TYPE_IPV4 = 0x0800
_MOST_IPV4_BYTES = 0xFFFF
_WORD = np.uint64(0xFFFF)

Rows = NDArray[np.uint8]


def checksum(rows: Rows) -> NDArray[np.uint16]:
    """Return the Internet checksum (n,) of each row (n, size), as RFC 1071 defines it.

    It is the complement of the one's complement sum of the 16-bit words; an odd last byte counts
    as the high byte of a word. Rows that hold their own right checksum give 0.
    """
    return _complement(_sum(rows))


def udp_datagrams(
    payload: Rows,
    source_ip: ArrayLike,
    target_ip: ArrayLike,
    source_port: ArrayLike,
    target_port: ArrayLike,
) -> Rows:
    """Return UDP datagrams with their checksums (a checksum of 0 is sent as 0xFFFF, RFC 768)."""
    rows, header = _with_header(payload, UDP_HEADER)
    header["source"] = source_port
    header["target"] = target_port
    header["bytes"] = rows.shape[1]
    sums = _with_pseudo_header(rows, UDP, source_ip, target_ip)
    header["checksum"] = np.where(sums == 0, 0xFFFF, sums)
    return rows


def tcp_segments(
    payload: Rows,
    source_ip: ArrayLike,
    target_ip: ArrayLike,
    source_port: ArrayLike,
    target_port: ArrayLike,
    sequence: ArrayLike,
    acknowledgement: ArrayLike = 1,
    flags: ArrayLike = ACK | PSH,
    window: ArrayLike = 0xFFFF,
) -> Rows:
    """Return TCP segments with their checksums; `sequence` is taken modulo 2^32."""
    rows, header = _with_header(payload, TCP_HEADER)
    header["source"] = source_port
    header["target"] = target_port
    header["sequence"] = np.asarray(sequence, np.int64) & 0xFFFFFFFF
    header["acknowledgement"] = acknowledgement
    header["words"] = TCP_HEADER.itemsize // 4 << 4
    header["flags"] = flags
    header["window"] = window
    header["checksum"] = _with_pseudo_header(rows, TCP, source_ip, target_ip)
    return rows


def ipv4_packets(
    body: Rows,
    source_ip: ArrayLike,
    target_ip: ArrayLike,
    protocol: ArrayLike,
    *,
    ttl: ArrayLike,
    identification: ArrayLike = 0,
    dscp: ArrayLike = 0,
    flags: ArrayLike = DONT_FRAGMENT,
    offset_bytes: ArrayLike = 0,
) -> Rows:
    """Return IPv4 packets or fragments with their header checksums.

    Args:
        body: the datagram or segment, or the fragment's piece of it.
        source_ip, target_ip: addresses as numbers.
        protocol: `UDP` or `TCP`.
        ttl: time to live, 1 to 255.
        identification: equal for the fragments of one packet; taken modulo 2^16.
        dscp: differentiated services code point, 0 to 63.
        flags: `DONT_FRAGMENT`, `MORE_FRAGMENTS` or 0.
        offset_bytes: where the fragment's piece begins, a multiple of 8.

    Raises:
        InputError: the packet would be above 65,535 bytes.
    """
    rows, header = _with_header(body, IPV4)
    if rows.shape[1] > _MOST_IPV4_BYTES:
        raise InputError(
            f"an IPv4 packet has {_MOST_IPV4_BYTES} bytes at most (got {rows.shape[1]})"
        )
    header["version_length"] = 4 << 4 | IPV4.itemsize // 4
    header["dscp_ecn"] = np.asarray(dscp, np.uint8) << 2
    header["total_bytes"] = rows.shape[1]
    header["identification"] = np.asarray(identification, np.int64) & 0xFFFF
    header["flags_offset"] = np.asarray(flags) | np.asarray(offset_bytes) // 8
    header["ttl"] = ttl
    header["protocol"] = protocol
    header["source"] = source_ip
    header["target"] = target_ip
    header["checksum"] = checksum(rows[:, : IPV4.itemsize])
    return rows


def ethernet_frames(packets: Rows, source_mac: Rows, target_mac: Rows) -> Rows:
    """Return Ethernet frames of IPv4 packets; the MAC addresses are (n, 6) or (1, 6)."""
    rows, header = _with_header(packets, ETHERNET)
    header["source"] = source_mac
    header["target"] = target_mac
    header["type"] = _TYPE_IPV4
    return rows


def target_mac(target_ip: NDArray[np.uint32], next_ip: int) -> Rows:
    """Return (n, 6): the MAC of a packet's group where it has one, otherwise of the next node."""
    macs = mac_bytes(target_ip)
    is_group = macs[:, :1] & 1
    return np.where(is_group == 1, macs, mac_bytes(next_ip))


def _with_header(payload: Rows, layout: "np.dtype[np.void]") -> tuple[Rows, NDArray[np.void]]:
    """Return the payload behind a header of zeros, and a view (n,) of that header."""
    n, size = payload.shape
    rows = np.zeros((n, layout.itemsize + size), np.uint8)
    rows[:, layout.itemsize :] = payload
    header: NDArray[np.void] = np.ndarray(n, layout, rows, 0, rows.strides[:1])
    return rows, header


def _with_pseudo_header(
    rows: Rows, protocol: int, source_ip: ArrayLike, target_ip: ArrayLike
) -> NDArray[np.uint16]:
    """Return the checksums (n,) of UDP or TCP, which cover addresses, protocol and length too."""
    total = _sum(rows) + np.uint64(protocol + rows.shape[1])
    for ip in (source_ip, target_ip):
        numbers = np.asarray(ip, np.uint64)
        total += (numbers >> np.uint64(16)) + (numbers & _WORD)
    return _complement(total)


def _sum(rows: Rows) -> NDArray[np.uint64]:
    """Return the sums (n,) of the 16-bit words of each row."""
    n, size = rows.shape
    words = np.ascontiguousarray(rows[:, : size - size % 2]).view(">u2").reshape(n, size // 2)
    total = words.sum(axis=1, dtype=np.uint64)
    if size % 2:
        total += rows[:, -1].astype(np.uint64) << np.uint64(8)
    return total


def _complement(total: NDArray[np.uint64]) -> NDArray[np.uint16]:
    """Return the complements of sums below 2^32, whose carries are added at the low end."""
    for _ in range(2):
        total = (total & _WORD) + (total >> np.uint64(16))
    return (total ^ _WORD).astype(np.uint16)
