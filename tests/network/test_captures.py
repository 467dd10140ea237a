"""What a run writes of a link, and what comes of it when it is played back."""

import numpy as np
import pandas as pd

from network.builders import joined
from network.test_network_federate import delivered, run_file
from tieline.network.federate import open_participant
from tieline.network.packet import PacketEngine
from tieline.network.pcap import read_pcap
from tieline.network.queues import DropTail
from tieline.network.spec import CrossFlow, Link
from tieline.network.traffic.trace import replayed


def captured(folder, **network):
    """Return the capture of the link between b and c of a run, and its row of links.parquet."""
    run = run_file(folder, capture=[["c", "b"]], **network)
    participant = open_participant(run, folder)
    delivered(participant, 90)
    participant.finish()
    links = pd.read_parquet(folder / "links.parquet")
    own = links[links["from"].isin(["b", "c"]) & links["to"].isin(["b", "c"])]
    return folder / "b-c.pcap", int(own["packets"].sum())


def test_a_capture_holds_what_the_link_carried(tmp_path):
    """Otherwise Wireshark would show another network than the tables.

    Besides each stream's packets stands its configuration frame. Of the six streams through the
    link the queue at c, one packet long, drops two.
    """
    path, packets = captured(tmp_path)
    trace = read_pcap(path)
    assert np.all(np.diff(trace.times_ns) >= 0)
    sizes, counts = np.unique(trace.sizes_bytes, return_counts=True)
    frames = dict(zip(sizes.tolist(), counts.tolist(), strict=True))
    assert frames.pop(62) == packets
    assert sum(frames.values()) == 4
    assert (tmp_path / "hosts").read_text().count("pmu") == 3


def test_segments_and_acknowledgements_are_captured_both_ways(tmp_path):
    """Otherwise a capture of connections would show half of what the link carried."""
    path, packets = captured(tmp_path, transport="tcp")
    sizes, counts = np.unique(read_pcap(path).sizes_bytes, return_counts=True)
    frames = dict(zip(sizes.tolist(), counts.tolist(), strict=True))
    # 34 bytes and none, after 40 of headers.
    assert frames[74] + frames[40] == packets
    assert 0 < frames[40] <= frames[74]


def test_a_capture_is_played_back_as_it_was(tmp_path):
    """Otherwise recorded traffic would load a link less, or at other times."""
    path, _ = captured(tmp_path)
    recorded = read_pcap(path)
    flow = CrossFlow("replay", replayed(path), ("a", "b"))
    link = Link("a", "b", 10**8, 0, DropTail(1000))
    engine = PacketEngine(joined([link], [], [], [flow]), seed=1)
    engine.run_until(10**12)
    used = engine.links()[0]
    assert (used.packets, used.bytes) == (len(recorded.sizes_bytes), recorded.sizes_bytes.sum())
