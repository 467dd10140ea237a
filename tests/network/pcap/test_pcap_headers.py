"""Headers, byte by byte against another program's and against the RFCs."""

import dpkt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tieline.errors import InputError
from tieline.network.pcap.headers import (
    DONT_FRAGMENT,
    MORE_FRAGMENTS,
    checksum,
    ethernet_frames,
    ipv4_packets,
    tcp_segments,
    udp_datagrams,
)

ROWS = hnp.arrays(np.uint8, st.tuples(st.integers(0, 5), st.integers(0, 70)))
IP = st.integers(0, 2**32 - 1)
PORT = st.integers(0, 2**16 - 1)


def test_the_checksum_is_that_of_rfc_1071s_example():
    """Section 3 of the RFC: these bytes sum to ddf2."""
    row = np.frombuffer(bytes.fromhex("0001f203f4f5f6f7"), np.uint8)
    assert checksum(row[np.newaxis]) == [0xFFFF ^ 0xDDF2]


@given(ROWS)
def test_checksums_of_many_rows_are_another_programs(rows: np.ndarray):
    """A capture with wrong checksums would be blamed on the network."""
    expected = [dpkt.in_cksum(row.tobytes()) for row in rows]
    assert checksum(rows).tolist() == expected


@given(ROWS, IP, IP, PORT, PORT, st.integers(0, 63), st.integers(1, 255), st.integers(0, 2**40))
def test_udp_frames_are_those_that_dpkt_packs(
    payload: np.ndarray,
    source_ip: int,
    target_ip: int,
    source: int,
    target: int,
    dscp: int,
    ttl: int,
    number: int,
):
    """Otherwise Wireshark, or whoever replays the capture, gets frames that no host sends."""
    datagrams = udp_datagrams(payload, source_ip, target_ip, source, target)
    packets = ipv4_packets(
        datagrams, source_ip, target_ip, 17, ttl=ttl, dscp=dscp, identification=number
    )
    macs = (np.full((1, 6), 2, np.uint8), np.full((1, 6), 4, np.uint8))
    frames = ethernet_frames(packets, *macs)
    assert frames.shape == (len(payload), 14 + 20 + 8 + payload.shape[1])
    for row, frame in zip(payload, frames, strict=True):
        udp = dpkt.udp.UDP(sport=source, dport=target, data=row.tobytes(), ulen=8 + len(row))
        packed = dpkt.ethernet.Ethernet(
            src=b"\2" * 6,
            dst=b"\4" * 6,
            data=dpkt.ip.IP(
                src=source_ip.to_bytes(4, "big"),
                dst=target_ip.to_bytes(4, "big"),
                p=17,
                ttl=ttl,
                tos=dscp << 2,
                id=number & 0xFFFF,
                df=1,
                data=udp,
            ),
        )
        assert frame.tobytes() == bytes(packed)


@given(ROWS, IP, IP, PORT, PORT, st.integers(0, 2**40))
def test_tcp_segments_are_those_that_dpkt_packs(
    payload: np.ndarray, source_ip: int, target_ip: int, source: int, target: int, sequence: int
):
    """The same over TCP, whose checksum covers the payload too."""
    segments = tcp_segments(payload, source_ip, target_ip, source, target, sequence)
    packets = ipv4_packets(segments, source_ip, target_ip, 6, ttl=64)
    for row, packet in zip(payload, packets, strict=True):
        tcp = dpkt.tcp.TCP(
            sport=source,
            dport=target,
            seq=sequence & 0xFFFFFFFF,
            ack=1,
            flags=0x18,
            win=0xFFFF,
            data=row.tobytes(),
        )
        ends = {"src": source_ip.to_bytes(4, "big"), "dst": target_ip.to_bytes(4, "big")}
        assert packet.tobytes() == bytes(dpkt.ip.IP(**ends, p=6, ttl=64, df=1, data=tcp))


def test_a_udp_checksum_of_zero_is_sent_as_all_ones():
    """RFC 768: a transmitted 0 says that there is no checksum."""
    plain = udp_datagrams(np.zeros((1, 2), np.uint8), 0, 0, 0, 0)
    missing = 0xFFFF - (17 + 10 + 10)
    payload = np.array([[missing >> 8, missing & 0xFF]], np.uint8)
    full = udp_datagrams(payload, 0, 0, 0, 0)
    assert plain[0, 6:8].tolist() != [0xFF, 0xFF] == full[0, 6:8].tolist()


def test_fragments_carry_their_offset_and_all_but_the_last_say_that_more_come():
    """A receiver puts a packet together from these words alone (RFC 791)."""
    body = np.arange(100, dtype=np.uint8)[np.newaxis]
    pieces = {0: MORE_FRAGMENTS, 48: MORE_FRAGMENTS, 96: 0}
    for first, flags in pieces.items():
        piece = body[:, first : first + 48]
        row = ipv4_packets(piece, 1, 2, 17, ttl=9, flags=flags, offset_bytes=first)[0]
        packet = dpkt.ip.IP(row.tobytes())
        assert (8 * packet.offset, packet.mf, packet.df) == (first, flags > 0, 0)
        assert dpkt.in_cksum(row[:20].tobytes()) == 0
    whole = dpkt.ip.IP(ipv4_packets(body, 1, 2, 17, ttl=9, flags=DONT_FRAGMENT)[0].tobytes())
    assert (whole.offset, whole.mf, whole.df) == (0, 0, 1)


def test_a_packet_beyond_65535_bytes_is_refused():
    """Its length would not fit the header."""
    with pytest.raises(InputError, match="65535 bytes at most"):
        ipv4_packets(np.zeros((1, 65_516), np.uint8), 1, 2, 17, ttl=9)
