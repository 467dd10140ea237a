"""Wireshark's own reader sees in a capture what was put into it."""

import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest

from network.pcap.taps import (
    EPOCH_S,
    FRAMES,
    IDCODES,
    MEASURED,
    RATE_HZ,
    SPEC,
    captured,
    tapped,
)
from tieline.c37118.batch import FRAME
from tieline.errors import InputError
from tieline.network.pcap import TCP, UDP, AddressPlan, address_plan, hosts_text, read_pcap
from tieline.units import NS_PER_S, tick_ns

pytestmark = [
    pytest.mark.tshark,
    pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed"),
]

CHECKED = [f"-o{name}.check_checksum:TRUE" for name in ("ip", "udp", "tcp")]
DATA, CONFIG_2 = 0, 3
GOOD = "1"
LAST_PART = {"udp": 0, "tcp": 0, "multicast": 0, "fragments": 2}
ROCOF = "rate_change_frequency"
WORDS = {
    "idcode_stream_source": "IDCODE",
    "soc": "SOC",
    "phasor": "PHASOR",
    "actual_frequency_value": "FREQ",
    ROCOF: "DFREQ",
}
KINDS = ("udp", "tcp", "multicast", "fragments")


def plan_of(kind: str) -> AddressPlan:
    plan = address_plan(SPEC, 34, TCP if kind == "tcp" else UDP, kind == "multicast")
    plan.flows["dscp"][:6] = 46
    if kind == "fragments":
        plan.flows["fragment_bytes"][[3, 5, 6]] = 16, 16, 96
    return plan


class Decoded:
    """A packet as tshark's PDML has it."""

    def __init__(self, packet: ElementTree.Element) -> None:
        self._fields = {field.get("name"): field for field in packet.iter("field")}
        self.protocols = [proto.get("name") for proto in packet.findall("proto")]
        self.is_doubted = "_ws.expert" in self._fields or "_ws.malformed" in self.protocols

    def shown(self, name: str) -> str:
        """Return the value of a field as tshark writes it."""
        return self._fields[name].get("show", "")

    def described(self, name: str) -> str:
        """Return the line that Wireshark's tree shows for a field."""
        return self._fields[name].get("showname", "")

    def integer(self, name: str) -> int:
        """Return a field's number from the bytes that tshark took for it."""
        return int(self._fields[name].get("value", ""), 16)

    def has(self, name: str) -> bool:
        return name in self._fields


class Captured(NamedTuple):
    """A capture of one kind: what went in, in order of time, and what tshark sees, in its order."""

    kind: str
    records: np.ndarray
    packets: list[Decoded]

    @property
    def configurations(self) -> list[Decoded]:
        return [packet for packet in self.packets if _frame_type(packet) == CONFIG_2]

    @property
    def data(self) -> list[Decoded]:
        return [packet for packet in self.packets if _frame_type(packet) == DATA]

    @property
    def decoded(self) -> np.ndarray:
        """The records with which a PMU's frame is whole: those of its last fragment."""
        is_pmu = self.records["flow"] < 6
        return self.records[is_pmu & (self.records["part"] == LAST_PART[self.kind])]


def _frame_type(packet: Decoded) -> int | None:
    name = "synphasor.frtype"
    return int(packet.shown(name), 0) if packet.has(name) else None


@pytest.fixture(scope="module", params=KINDS)
def capture(request, tmp_path_factory: pytest.TempPathFactory) -> Captured:
    plan = plan_of(request.param)
    records = tapped(plan)
    path = tmp_path_factory.mktemp("tshark") / "link.pcap"
    captured(path, plan, records, 1_000_000_000 // RATE_HZ)
    document = ElementTree.fromstring(tshark(path, "-T", "pdml"))
    packets = [Decoded(packet) for packet in document]
    return Captured(request.param, np.sort(records, order=("sent_ns", "port")), packets)


def tshark(path: Path, *options: str) -> str:
    command = ["tshark", "-n", "-r", str(path), *CHECKED, *options]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_every_packet_is_there_at_its_time_with_its_header(capture: Captured):
    """Delays are read off captures: a time that is 1 us off would be a delay that is 1 us off."""
    sent = [packet for packet in capture.packets if _frame_type(packet) != CONFIG_2]
    assert len(sent) == len(capture.records)
    for packet, record in zip(sent, capture.records, strict=True):
        seconds, nanoseconds = packet.shown("frame.time_epoch").split(".")
        assert (int(seconds) - EPOCH_S) * NS_PER_S + int(nanoseconds) == record["sent_ns"]
        assert int(packet.shown("ip.len")) == record["bytes"]
        assert int(packet.shown("ip.id"), 0) == record["sequence"]
        assert int(packet.shown("ip.ttl")) == 254 - record["hop"]
        assert int(packet.shown("ip.dsfield.dscp")) == (46 if record["flow"] < 6 else 0)


def test_every_checksum_is_good_and_nothing_is_doubted(capture: Captured):
    """Wireshark colours what it doubts: a user would look for the fault in the network."""
    for packet in capture.packets:
        assert not packet.is_doubted
        assert packet.shown("ip.checksum.status") == GOOD
    whole = [packet for packet in capture.packets if {"udp", "tcp"} & set(packet.protocols)]
    assert len(whole) == len(capture.configurations) + 4 * FRAMES
    for packet in whole:
        protocol = "tcp" if "tcp" in packet.protocols else "udp"
        assert packet.shown(f"{protocol}.checksum.status") == GOOD


def test_every_value_is_the_one_that_was_measured(capture: Captured):
    """A capture whose values differ from the run's tables would discredit both.

    tshark shows a value at all only if it found the stream's configuration before.
    """
    records = capture.decoded
    assert len(capture.data) == len(records) == 2 * FRAMES
    for packet, record in zip(capture.data, records, strict=True):
        source = SPEC.flows[record["flow"]].source
        frame = MEASURED[record["sequence"], source].view(FRAME)
        assert packet.shown("synphasor.checksum.status") == GOOD
        for field, word in WORDS.items():
            assert packet.integer(f"synphasor.{field}") == int(frame[word].tobytes().hex(), 16)
        # Six digits are what tshark prints of FREQ and DFREQ, thousandths of a phasor.
        shown = [packet.shown(f"synphasor.{field}") for field in ("actual_frequency_value", ROCOF)]
        expected = [frame["FREQ"][0], frame["DFREQ"][0]]
        assert [float(text) for text in shown] == pytest.approx(expected, rel=1e-5)
        real, imaginary = frame["PHASOR"][0]
        line = f"alt {real:>8.3f}+j{imaginary:>7.3f}V"
        assert line in packet.described("synphasor.phasor")


def test_time_tags_and_capture_times_have_one_origin(capture: Captured):
    """The age of a frame at a tap is the capture's time less the frame's own tag.

    Tags are whole microseconds; here the frames leave their PMU when they are measured.
    """
    records = capture.decoded
    for packet, record in zip(capture.data, records, strict=True):
        tag_ns = (packet.integer("synphasor.soc") - EPOCH_S) * NS_PER_S
        tag_ns += 1000 * packet.integer("synphasor.fracsec_raw")
        waited_ns = record["sent_ns"] - tick_ns(int(record["sequence"]), RATE_HZ)
        seconds, nanoseconds = packet.shown("frame.time_epoch").split(".")
        captured_ns = (int(seconds) - EPOCH_S) * NS_PER_S + int(nanoseconds)
        assert abs(captured_ns - tag_ns - waited_ns) <= 500


def test_each_stream_is_announced_once(capture: Captured):
    """Two configuration frames of one stream would say that it changed."""
    assert len(capture.configurations) == (1 if capture.kind == "multicast" else 2)
    for packet in capture.configurations:
        assert packet.integer("synphasor.idcode_stream_source") == IDCODES[1]
        assert int(packet.shown("synphasor.rate_of_transmission")) == RATE_HZ


def test_a_stations_name_comes_with_the_values(tmp_path: Path):
    """The name tells the reader whose frequency it is, and the hosts file who sent the packet."""
    plan = plan_of("udp")
    captured(tmp_path / "link.pcap", plan, tapped(plan), 10**9)
    (tmp_path / "hosts").write_text(hosts_text(SPEC, plan))
    text = subprocess.run(
        ["tshark", "-r", "link.pcap", "-H", "hosts", "-N", "n", "-c", "2", "-V"],
        check=True,
        capture_output=True,
        text=True,
        cwd=tmp_path,
    ).stdout
    assert 'Station: "p1' in text
    assert "Src: p1 (10.1.0.2), Dst: c0 (10.2.0.1)" in text


@pytest.mark.parametrize(("form", "tick_ns"), [("pcap", 1000), ("nsecpcap", 1)])
def test_what_wireshark_saves_again_is_read_back(tmp_path: Path, form: str, tick_ns: int):
    """Traffic for a replay often comes from Wireshark, in microseconds unless told otherwise."""
    plan = plan_of("udp")
    captured(tmp_path / "link.pcap", plan, tapped(plan), 10**9)
    own = read_pcap(tmp_path / "link.pcap")
    tshark(tmp_path / "link.pcap", "-F", form, "-w", str(tmp_path / "again.pcap"))
    again = read_pcap(tmp_path / "again.pcap")
    # The first packet leaves at 0, so that cutting to ticks commutes with taking its time away.
    assert again.times_ns.tolist() == (own.times_ns // tick_ns * tick_ns).tolist()
    assert again.sizes_bytes.tolist() == own.sizes_bytes.tolist()


def test_the_newer_format_is_refused_with_the_command_that_converts_it(tmp_path: Path):
    """It is what Wireshark saves unless told otherwise."""
    plan = plan_of("udp")
    captured(tmp_path / "link.pcap", plan, tapped(plan), 10**9)
    tshark(tmp_path / "link.pcap", "-F", "pcapng", "-w", str(tmp_path / "again.pcapng"))
    with pytest.raises(InputError, match=r"editcap -F nsecpcap again\.pcapng new\.pcap"):
        read_pcap(tmp_path / "again.pcapng")
