"""A capture of a link holds what went over it, in order, with the bytes that the PMUs sent."""

from pathlib import Path

import dpkt
import numpy as np
import pytest

from network.builders import chain
from network.pcap.taps import (
    EPOCH_S,
    FRAMES,
    IDCODES,
    LINK,
    MEASURED,
    RATE_HZ,
    SPEC,
    captured,
    payload_of,
    tapped,
)
from tieline.c37118 import ConfigFrame, DataFrame
from tieline.errors import CosimError, InputError
from tieline.network.pcap import TAP, TCP, UDP, Capture, address_plan, stream_configurations
from tieline.network.pcap.addresses import mac_bytes

STEP_NS = 1_000_000_000 // RATE_HZ
CROSS_BYTES = [flow.traffic.payload_bytes for flow in SPEC.cross_flows]
CONFIGURATIONS = stream_configurations(SPEC, IDCODES, 60, RATE_HZ, EPOCH_S)


def packets(path: Path) -> list[tuple[int, dpkt.ethernet.Ethernet]]:
    """Return (ns since the run's start, Ethernet frame) of each record."""
    with path.open("rb") as file:
        records = list(dpkt.pcap.Reader(file))
    return [(int(time * 10**9) - EPOCH_S * 10**9, dpkt.ethernet.Ethernet(d)) for time, d in records]


def opened(folder: Path, plan=None) -> Capture:
    plan = plan or address_plan(SPEC, 34)
    return Capture(folder / "link.pcap", SPEC, plan, LINK, CONFIGURATIONS, EPOCH_S)


def one(**changes: int) -> np.ndarray:
    """Return one record of the link, changed."""
    record = np.zeros(1, TAP)
    for name, value in {"port": 4, "flow": 3, "bytes": 62, **changes}.items():
        record[name] = value
    return record


def test_the_file_holds_every_packet_once_at_its_time_with_its_bytes(tmp_path: Path):
    """A capture is evidence: what is not in the run must not be in it, and nothing may be missing.

    The configuration frames are the one addition; each precedes the first frame of its flow.
    """
    plan = address_plan(SPEC, 34)
    records = tapped(plan)
    captured(tmp_path / "link.pcap", plan, records, STEP_NS)
    ends = plan.flows[["source_ip", "target_ip"]].tolist()
    expected = np.sort(records, order=("sent_ns", "port"))
    seen, is_announced = 0, set()
    for time_ns, ethernet in packets(tmp_path / "link.pcap"):
        ip = ethernet.data
        number = ends.index((int.from_bytes(ip.src, "big"), int.from_bytes(ip.dst, "big")))
        record = expected[seen]
        assert (time_ns, number) == (record["sent_ns"], record["flow"])
        if number < 6 and number not in is_announced:
            is_announced.add(number)
            config = ConfigFrame.from_bytes(ip.data.data)
            source = SPEC.sources[SPEC.flows[number].source]
            assert config.pmus[0].station == source.name
            assert (config.data_rate, config.prefix.soc) == (RATE_HZ, EPOCH_S)
            continue
        own = bytes(record["bytes"] - 28)
        if number < 6:
            own = MEASURED[record["sequence"], SPEC.flows[number].source].tobytes()
        assert ip.data.data == own
        assert (ip.len, ip.id, ip.ttl) == (record["bytes"], record["sequence"], 254 - record["hop"])
        seen += 1
    assert seen == len(expected) == FRAMES * 4
    assert is_announced == {3, 5}


def test_the_file_does_not_depend_on_the_steps_in_which_it_was_written(tmp_path: Path):
    """Packets that wait for the link past the end of a step must still stand in order of time."""
    plan = address_plan(SPEC, 34)
    records = tapped(plan)
    files = []
    for step_ns in (1_000_003, STEP_NS, 10**10):
        captured(tmp_path / "link.pcap", plan, records, step_ns)
        files.append((tmp_path / "link.pcap").read_bytes())
    assert files[0] == files[1] == files[2]


def test_each_direction_goes_from_its_node_to_the_other(tmp_path: Path):
    """Wireshark tells the directions of a link by the MAC addresses."""
    plan = address_plan(SPEC, 34)
    capture = opened(tmp_path)
    capture.add(np.concatenate([one(port=4), one(port=5)]), payload_of, 1)
    capture.close()
    c, d = (mac.tobytes() for mac in mac_bytes(plan.nodes[2:]))
    (_, first), (_, second) = packets(tmp_path / "link.pcap")[1:]
    assert ((first.src, first.dst), (second.src, second.dst)) == ((c, d), (d, c))


def test_a_multicast_stream_goes_to_its_group_and_is_announced_once(tmp_path: Path):
    """RFC 1112: a receiver's network card listens to the group's MAC address."""
    plan = address_plan(SPEC, 34, is_multicast=True)
    capture = opened(tmp_path, plan)
    capture.add(np.concatenate([one(flow=flow) for flow in (2, 1, 4)]), payload_of, 1)
    capture.close()
    frames = [ethernet for _, ethernet in packets(tmp_path / "link.pcap")]
    groups = [b"\xef\xc0\0\1"] * 3 + [b"\xef\xc0\0\2"] * 2
    assert [frame.ip.dst for frame in frames] == groups
    assert [len(frame.ip) for frame in frames] == [102, 62, 62, 102, 62]
    assert frames[0].dst == bytes.fromhex("01005e400001")


def test_fragments_put_together_are_the_datagram(tmp_path: Path):
    """A PMU frame of many phasors, or a large cross packet, is decoded after reassembly only."""
    plan = address_plan(SPEC, 34)
    plan.flows["fragment_bytes"][[3, 6, 7]] = 16, 96, 480
    records = tapped(plan)
    captured(tmp_path / "link.pcap", plan, records, STEP_NS)
    whole: dict[tuple[bytes, int], bytearray] = {}
    for _, ethernet in packets(tmp_path / "link.pcap"):
        ip = ethernet.data
        if ip.len == 102:
            continue
        body = bytes(ethernet)[34:]
        datagram = whole.setdefault((ip.src + ip.dst, ip.id), bytearray())
        assert 8 * ip.offset == len(datagram)
        datagram += body
    assert len(whole) == FRAMES * 4
    for key, datagram in whole.items():
        udp = dpkt.udp.UDP(bytes(datagram))
        assert (
            udp.ulen
            == len(datagram)
            == (42 if udp.dport == 4713 else 8 + CROSS_BYTES[key[0][3] - 1])
        )
        pseudo = key[0] + bytes([0, UDP]) + udp.ulen.to_bytes(2, "big")
        assert dpkt.in_cksum(pseudo + bytes(datagram)) == 0


def test_tcp_segments_follow_one_another_without_a_gap(tmp_path: Path):
    """Wireshark would report lost segments, and decode nothing after them."""
    plan = address_plan(SPEC, 34, TCP)
    capture = opened(tmp_path, plan)
    sequences = range(5, 9)
    rows = [one(sequence=k, sent_ns=k, bytes=74) for k in sequences]
    capture.add(np.concatenate(rows), payload_of, 100)
    capture.close()
    segments = [ethernet.data.data for _, ethernet in packets(tmp_path / "link.pcap")]
    size = len(CONFIGURATIONS[0])
    stream = b"".join(segment.data for segment in segments)
    begins = np.cumsum([0, *(len(segment.data) for segment in segments[:-1])])
    assert [s.seq for s in segments] == ((1 + 5 * 34 - size + begins) % 2**32).tolist()
    config = ConfigFrame.from_bytes(stream[:size])
    for k in sequences:
        first = size + 34 * (k - 5)
        assert DataFrame.from_bytes(stream[first : first + 34], config).prefix.idcode == IDCODES[1]


def test_only_what_went_on_the_link_by_the_end_is_in_the_file(tmp_path: Path):
    """A packet that still waited when the run ended was never sent."""
    capture = opened(tmp_path)
    capture.add(np.concatenate([one(sent_ns=ns) for ns in (9, 10, 11)]), payload_of, 10)
    capture.close()
    assert [time_ns for time_ns, _ in packets(tmp_path / "link.pcap")] == [9, 9]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"port": 2}, "ports 4 and 5 got a packet with port 2"),
        ({"flow": 8}, "with flow 8"),
        ({"flow": -1}, "with flow -1"),
        ({"hop": 254}, "with hop 254"),
        ({"part": 1}, "does not fit its flow"),
        ({"bytes": 27}, "does not fit its flow"),
        ({"bytes": 70_000}, "does not fit its flow"),
        ({"bytes": 63}, r"frames of 35 bytes, as large as their packets \(got \(1, 34\)\)"),
        ({"flow": 5}, "does not fit its flow"),
        ({"sent_ns": 49}, r"link.pcap is written up to 50 ns: .* 49 ns comes too late"),
    ],
)
def test_a_record_that_cannot_be_true_stops_the_run(
    tmp_path: Path, changes: dict[str, int], message: str
):
    """A capture that bends a record to fit would hide a fault of the network."""
    plan = address_plan(SPEC, 34)
    plan.flows["fragment_bytes"][5] = 24
    capture = opened(tmp_path, plan)
    capture.add(one(), payload_of, 50)
    with pytest.raises(CosimError, match=message):
        capture.add(one(**{"sent_ns": 50, **changes}), payload_of, 100)
    capture.close()


def test_a_capture_needs_its_link_and_every_configuration(tmp_path: Path):
    """Found when the run ends, either would cost the run."""
    plan = address_plan(SPEC, 34)
    with pytest.raises(InputError, match=r"a link 0 to 3 \(got 4\)"):
        Capture(tmp_path / "x.pcap", SPEC, plan, 4, CONFIGURATIONS)
    with pytest.raises(InputError, match=r"capture of 2 PMUs .* \(got 1\)"):
        Capture(tmp_path / "x.pcap", SPEC, plan, LINK, CONFIGURATIONS[:1])
    with pytest.raises(InputError, match=r"2 PMUs need as many idcodes \(got 3\)"):
        stream_configurations(SPEC, [1, 2, 3], 60, 60)
    assert not list(tmp_path.iterdir())


def test_a_long_name_is_cut_to_the_station_field():
    """Names of case files may be longer than the 16 characters of C37.118."""
    spec = chain([(10**6, 0)])
    long = spec.__class__(
        spec.nodes, spec.links, (spec.sources[0].__class__("a" * 20, 1, "n0"),), (), ()
    )
    (config,) = stream_configurations(long, [1], 50, 50)
    assert ConfigFrame.from_bytes(config).pmus[0].station == "a" * 16
