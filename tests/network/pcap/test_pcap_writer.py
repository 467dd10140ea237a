"""The pcap file itself: whole or not there, times to the nanosecond, in order."""

from pathlib import Path

import dpkt
import numpy as np
import pytest

from tieline.errors import CosimError, InputError
from tieline.network.pcap import PcapWriter
from tieline.network.pcap.writer import Group

EPOCH_S = 1_700_000_000


def frames(count: int, size: int, start: int = 0) -> np.ndarray:
    return (np.arange(count * size).reshape(count, size) + start).astype(np.uint8)


def test_frames_of_several_sizes_come_back_in_their_places(tmp_path: Path):
    """A frame at another's time, or with another's bytes, would be a false record of a run."""
    path = tmp_path / "link.pcap"
    times_ns = np.array([0, 5, 999_999_999, 1_000_000_000, 41_123_456_789])
    long, short = frames(2, 60), frames(3, 14, 7)
    with PcapWriter(path, EPOCH_S) as writer:
        groups = [Group(np.array([3, 0]), long), Group(np.array([1, 2, 4]), short)]
        writer.write(times_ns, groups)
        writer.write(times_ns[4:], [Group(np.array([0]), long[:1])])
        assert writer.frames == 6
    with path.open("rb") as file:
        reader = dpkt.pcap.Reader(file)
        assert reader.datalink() == 1
        records = list(reader)
    # dpkt gives nanoseconds as exact decimals.
    assert [int(time * 10**9) - EPOCH_S * 10**9 for time, _ in records] == [
        *times_ns.tolist(),
        41_123_456_789,
    ]
    rows = [long[1], short[0], short[1], long[0], short[2], long[0]]
    assert [data for _, data in records] == [row.tobytes() for row in rows]


def test_the_file_appears_when_it_is_whole(tmp_path: Path):
    """Half a capture under its final name would be taken for a whole one."""
    path = tmp_path / "link.pcap"
    writer = PcapWriter(path)
    writer.write(np.array([1]), [Group(np.array([0]), frames(1, 20))])
    assert [item.name for item in tmp_path.iterdir()] == [".link.pcap.part"]
    writer.close()
    writer.close()
    assert [item.name for item in tmp_path.iterdir()] == ["link.pcap"]


def test_a_writer_that_fails_leaves_nothing_under_the_final_name(tmp_path: Path):
    """The same when the run stops with an error."""
    with pytest.raises(ZeroDivisionError), PcapWriter(tmp_path / "link.pcap"):
        _ = 1 // 0
    assert not (tmp_path / "link.pcap").exists()


@pytest.mark.parametrize("times_ns", [[5, 4], [2], [-1]])
def test_times_out_of_order_are_refused(tmp_path: Path, times_ns: list[int]):
    """Tools that read captures take the order of records for the order of events."""
    writer = PcapWriter(tmp_path / "link.pcap")
    writer.write(np.array([3]), [Group(np.array([0]), frames(1, 20))])
    groups = [Group(np.arange(len(times_ns)), frames(len(times_ns), 20))]
    with pytest.raises(CosimError, match=r"frame after number 1 of link\.pcap"):
        writer.write(np.array(times_ns), groups)
    writer.close()


def test_times_beyond_32_bits_of_seconds_are_refused(tmp_path: Path):
    """They would wrap round to 1970."""
    for epoch_s in (-1, 1 << 32):
        with pytest.raises(InputError, match=rf"0 to 4294967295 s \(got {epoch_s}\)"):
            PcapWriter(tmp_path / "link.pcap", epoch_s)
    writer = PcapWriter(tmp_path / "link.pcap", (1 << 32) - 1)
    writer.write(np.array([999_999_999]), [Group(np.array([0]), frames(1, 20))])
    with pytest.raises(CosimError, match="too late"):
        writer.write(np.array([1_000_000_000]), [Group(np.array([0]), frames(1, 20))])
    writer.close()
