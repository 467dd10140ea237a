"""Recorded traffic: every kind of file gives the same times and sizes, a faulty one is refused."""

import struct
from collections.abc import Sequence
from pathlib import Path

import dpkt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.errors import InputError
from tieline.network.pcap import read_pcap

ETHERNET, PPP, RAW = 1, 9, 101
MAC = bytes(12)
Record = tuple[int, bytes]


def ipv4(size: int) -> bytes:
    return bytes(dpkt.ip.IP(p=17, data=bytes(size - 20), len=size))


def ipv6(size: int) -> bytes:
    return struct.pack(">IHBB", 6 << 28, size - 40, 17, 64) + bytes(size - 8)


def pcap(
    records: Sequence[Record], link_type: int = RAW, order: str = "<", ns: bool = True
) -> bytes:
    """Return a file of records (time in ns, frame)."""
    magic = 0xA1B23C4D if ns else 0xA1B2C3D4
    data = struct.pack(f"{order}IHHiIII", magic, 2, 4, 0, 0, 65_535, link_type)
    for time_ns, frame in records:
        seconds, fraction = divmod(time_ns, 10**9)
        ticks = fraction if ns else fraction // 1000
        data += struct.pack(f"{order}IIII", seconds, ticks, len(frame), len(frame)) + frame
    return data


def written(folder: Path, data: bytes) -> Path:
    path = folder / "traffic.pcap"
    path.write_bytes(data)
    return path


@given(
    st.lists(st.tuples(st.integers(0, 2**41), st.integers(20, 300)), min_size=1, max_size=20),
    st.sampled_from("<>"),
    st.booleans(),
    st.sampled_from(["raw", "ethernet", "vlan", "qinq", "ppp", "hdlc", "ipv6"]),
)
def test_every_kind_of_file_gives_the_times_and_sizes_put_in(
    tmp_path_factory: pytest.TempPathFactory,
    packets: list[tuple[int, int]],
    order: str,
    ns: bool,
    kind: str,
):
    """A trace from another recorder would load the simulated network differently."""
    ahead, link_type = {
        "raw": (b"", RAW),
        "ethernet": (MAC + b"\x08\x00", ETHERNET),
        "vlan": (MAC + b"\x81\x00\x00\x07\x08\x00", ETHERNET),
        "qinq": (MAC + b"\x88\xa8\x00\x07\x81\x00\x00\x09\x08\x00", ETHERNET),
        "ppp": (b"\x00\x21", PPP),
        "hdlc": (b"\xff\x03\x00\x21", PPP),
        "ipv6": (MAC + b"\x86\xdd", ETHERNET),
    }[kind]
    make, least = (ipv6, 40) if kind == "ipv6" else (ipv4, 20)
    packets = sorted((time_ns, max(size, least)) for time_ns, size in packets)
    records = [(time_ns, ahead + make(size)) for time_ns, size in packets]
    folder = tmp_path_factory.mktemp("traffic")
    trace = read_pcap(written(folder, pcap(records, link_type, order, ns)))
    tick_ns = 1 if ns else 1000
    times_ns = np.array([time_ns // tick_ns * tick_ns for time_ns, _ in packets])
    assert trace.times_ns.tolist() == (times_ns - times_ns[0]).tolist()
    assert trace.sizes_bytes.tolist() == [size for _, size in packets]
    assert trace.others == 0


def test_sizes_are_those_of_the_ip_packets_not_of_what_was_captured(tmp_path: Path):
    """Ethernet pads short packets, recorders cut long ones, network cards leave lengths out."""
    head = MAC + b"\x08\x00"
    padded = head + ipv4(28) + bytes(18)
    cut = (head + ipv4(1500))[:60]
    offloaded = bytearray(head + ipv4(300))
    offloaded[16:18] = b"\0\0"
    data = pcap([(5, padded)], ETHERNET)
    data += struct.pack("<IIII", 0, 7, 60, 1514) + cut
    data += struct.pack("<IIII", 0, 9, 60, 70_034) + bytes(offloaded[:60])
    trace = read_pcap(written(tmp_path, data))
    assert trace.sizes_bytes.tolist() == [28, 1500, 70_020]
    assert trace.times_ns.tolist() == [0, 2, 4]


def test_frames_that_are_not_ip_are_counted_and_left_out(tmp_path: Path):
    """Address resolution of the recorded network is not traffic of the simulated one."""
    arp = MAC + b"\x08\x06" + bytes(28)
    records = [(1, arp), (3, MAC + b"\x08\x00" + ipv4(40)), (4, MAC), (9, arp)]
    trace = read_pcap(written(tmp_path, pcap(records, ETHERNET)))
    assert (trace.times_ns.tolist(), trace.sizes_bytes.tolist(), trace.others) == ([0], [40], 3)


WHOLE = pcap([(5, ipv4(60)), (6, ipv4(60))])
BROKEN = struct.pack("<IIII", 0, 10**9, 20, 20) + ipv4(20)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "shorter than the 24 bytes"),
        (WHOLE[:20], "shorter than the 24 bytes"),
        (WHOLE[:-1], r"record 2 is cut off: the file ends at byte 175"),
        (WHOLE[:110], "record 2 is cut off"),
        (b"GIF89a" + bytes(30), "no pcap file: it begins with 0x47494638"),
        (bytes.fromhex("0a0d0d0a") + bytes(30), r"pcapng.*editcap -F nsecpcap traffic\.pcap"),
        (pcap([(5, ipv4(60))], 105), "link type 105 is not known"),
        (pcap([]), "none of its 0 records"),
        (pcap([(1, MAC + b"\x08\x06" + bytes(28))], ETHERNET), "none of its 1 records"),
        (pcap([(1, ipv4(20)), (9, ipv4(20)), (7, ipv4(20))]), "record 3 is 2 ns before"),
        (WHOLE + BROKEN, "record 3 has a fraction of 1000000000 ns"),
        (pcap([(1, ipv4(60)), (2, ipv4(20)[:5])]), "record 2 holds 5 bytes of its frame"),
    ],
)
def test_a_faulty_file_is_refused_with_its_name_and_record(
    tmp_path: Path, data: bytes, message: str
):
    """Otherwise a replay would run with part of the traffic and nobody would know."""
    with pytest.raises(InputError, match=rf"traffic\.pcap: .*{message}"):
        read_pcap(written(tmp_path, data))


def test_a_missing_file_is_refused_by_its_name(tmp_path: Path):
    """The user mistyped a path; a traceback would not say so."""
    with pytest.raises(InputError, match=r"none\.pcap: cannot be read: No such file"):
        read_pcap(tmp_path / "none.pcap")
