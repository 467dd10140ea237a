"""The network in the federation: the bytes that go in come out, in time, and are then let go."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tieline.cosim.interfaces import Clock, DeliveryBundle, FrameBundle
from tieline.errors import CosimError, InputError, TimeContractBroken
from tieline.network.federate import open_participant
from tieline.resources import case_folder
from tieline.tables import read_table, units_of

MINIWECC = case_folder("miniwecc") / "network.yaml"

TOPOLOGY = """\
link_defaults: {rate: 1 Mbit/s, queue: 1, overhead: 9}
pmu: {processing: 20 ms}
controller: {processing: 1 ms}
nodes:
  a: {buses: [1, 11]}
  b: {buses: [2, 12]}
  c: {buses: [3]}
links:
  - {a: a, b: b, propagation: 2 ms}
  - {a: b, b: c, propagation: 3 ms, loss: 0.1}
"""
SOURCES = [{"name": f"pmu{i:02d}", "bus": bus} for i, bus in enumerate((1, 2, 3))]
DESTINATIONS = [
    {"name": f"ctl{j:02d}", "unit": f"G{j}", "bus": bus} for j, bus in enumerate((11, 12, 3, 1, 2))
]
CLOCK = Clock(60, 90)


def run_file(folder: Path, intervals: int = 90, **network: Any) -> dict[str, Any]:
    """Return a run file's content, as far as the network reads it."""
    path = folder / "network.yaml"
    path.write_text(TOPOLOGY, encoding="utf-8")
    settings = {"engine": "packet", "topology": str(path)} | network
    return {
        "seed": 3,
        "frequency_hz": 60.0,
        "clock": {"rate_hz": 60, "intervals": intervals},
        "network": settings,
        "sources": SOURCES,
        "destinations": DESTINATIONS,
    }


def frames(k: int) -> FrameBundle:
    """Return frames of distinct bytes, measured at t_k."""
    rows = np.arange(3 * 34).reshape(3, 34)
    return FrameBundle(CLOCK.at_ns(k), ((rows + 7 * k) % 251).astype(np.uint8))


def delivered(participant: Any, intervals: int) -> list[DeliveryBundle]:
    """Return the deliveries of a whole run."""
    assert participant.start() == []
    return [
        DeliveryBundle.from_bytes(participant.advance(k, frames(k).to_bytes()))
        for k in range(intervals)
    ]


ENGINES = [
    {},
    {"engine": "ideal", "topology": None},
    {"engine": "constant", "delay": 0.25, "topology": None},
]


@pytest.mark.parametrize("network", ENGINES, ids=["packet", "ideal", "constant"])
def test_each_delivery_carries_the_bytes_that_were_measured(tmp_path, network):
    """Otherwise a controller would act on another sensor's frame."""
    participant = open_participant(run_file(tmp_path, **network), tmp_path)
    count = 0
    for k, bundle in enumerate(delivered(participant, 90)):
        assert bundle.until_ns == CLOCK.at_ns(k + 1)
        rows = bundle.records
        assert np.all(rows["arrival_ns"] <= bundle.until_ns)
        assert np.all(rows["arrival_ns"] >= CLOCK.at_ns(k))
        for row in rows:
            expected = frames(int(row["sequence"])).payloads[row["source"]]
            assert np.array_equal(bundle.payloads[row["payload"]], expected)
        pairs = {(int(row["sequence"]), int(row["source"])) for row in rows}
        assert len(bundle.payloads) == len(pairs)
        count += len(rows)
    assert count > 500


def test_a_frame_is_let_go_with_its_last_packet(tmp_path):
    """Otherwise the memory of a long run would grow with it."""
    participant = open_participant(run_file(tmp_path, mean_delay=0.1), tmp_path)
    delivered(participant, 90)
    frames = participant._frames
    kept = frames._sequences[frames._under_way > 0]
    # 0.1 s is six intervals; losses end a frame's packets, too.
    assert 5 <= len(kept) <= 8
    assert min(kept) >= 82
    assert len(frames._sequences) <= 16


def test_an_ideal_frame_comes_back_in_its_own_interval(tmp_path):
    """Otherwise ideal communication would lag by an interval."""
    run = run_file(tmp_path, engine="ideal", topology=None)
    bundles = delivered(open_participant(run, tmp_path), 3)
    for k, bundle in enumerate(bundles):
        assert set(bundle.records["arrival_ns"].tolist()) == {CLOCK.at_ns(k)}
        assert len(bundle.records) == 15


def test_no_frames_give_no_deliveries(tmp_path):
    """Otherwise continuous reporting, where the grid forms the average itself, would fail."""
    run = run_file(tmp_path, engine="constant", delay=0.1, topology=None)
    participant = open_participant(run, tmp_path)
    empty = FrameBundle(0, np.empty((0, 0), np.uint8)).to_bytes()
    bundle = DeliveryBundle.from_bytes(participant.advance(0, empty))
    assert (len(bundle.records), len(bundle.payloads)) == (0, 0)
    participant.finish()
    assert read_table(tmp_path / "flows.parquet")["sent"].sum() == 0
    assert len(read_table(tmp_path / "delays.parquet")) == 0


def test_frames_of_another_instant_or_size_are_refused(tmp_path):
    """Otherwise a broken federation would pass for a slow network."""
    participant = open_participant(run_file(tmp_path), tmp_path)
    with pytest.raises(TimeContractBroken, match="interval 0 needs the frames of 0 ns"):
        participant.advance(0, frames(1).to_bytes())
    short = FrameBundle(0, np.zeros((2, 34), np.uint8)).to_bytes()
    with pytest.raises(CosimError, match="3 frames of 34 bytes, or none"):
        participant.advance(0, short)
    with pytest.raises(CosimError, match="expected a TLF1 bundle"):
        participant.advance(0, b"nonsense")


def test_a_constant_engine_needs_its_delay(tmp_path):
    """Otherwise it would be an ideal one."""
    run = run_file(tmp_path, engine="constant", topology=None)
    with pytest.raises(InputError, match=r"network\.delay must be given"):
        open_participant(run, tmp_path)


def test_tables_account_for_every_packet(tmp_path):
    """Otherwise the results would contradict one another."""
    participant = open_participant(run_file(tmp_path, record_packets=True), tmp_path)
    bundles = delivered(participant, 90)
    participant.finish()
    flows = read_table(tmp_path / "flows.parquet")
    links = read_table(tmp_path / "links.parquet")
    delays = read_table(tmp_path / "delays.parquet")
    packets = read_table(tmp_path / "packets.parquet")
    assert flows["flow"].tolist() == list(range(15))
    assert flows["sent"].tolist() == [90] * 15
    ended = flows["delivered"] + flows["dropped_queue"] + flows["dropped_loss"]
    assert (flows["sent"] == ended + flows["in_flight"]).all()
    count = sum(len(bundle.records) for bundle in bundles)
    assert flows["delivered"].sum() == delays["count"].sum() == count
    by_outcome = [int((packets["outcome"] == outcome).sum()) for outcome in range(3)]
    names = ("delivered", "dropped_queue", "dropped_loss")
    assert by_outcome == [flows[name].sum() for name in names]
    assert all(count > 0 for count in by_outcome)
    assert links["dropped_loss"].sum() == flows["dropped_loss"].sum()
    delay_s = (packets["ended_ns"] - packets["measured_ns"])[packets["outcome"] == 0] / 1e9
    mean_s = (flows["delay_mean_s"] * flows["delivered"]).sum() / count
    assert delay_s.mean() == pytest.approx(mean_s, rel=1e-12)
    assert flows["delay_max_s"].max() == delay_s.max()
    assert (links["utilisation"] < 1).all()
    assert set(flows["hops"]) == {0, 1, 2}


def test_columns_say_their_unit(tmp_path):
    """Otherwise a reader would have to guess seconds from milliseconds."""
    participant = open_participant(run_file(tmp_path), tmp_path)
    delivered(participant, 2)
    participant.finish()
    for name in ("flows", "links", "delays"):
        units = units_of(tmp_path / f"{name}.parquet")
        assert all(description for _, description in units.values())
        assert all(unit == "s" for column, (unit, _) in units.items() if column.endswith("_s"))


def test_an_aborted_run_leaves_its_tables(tmp_path):
    """Otherwise a run that failed late would have nothing to show."""
    participant = open_participant(run_file(tmp_path, record_packets=True), tmp_path)
    delivered(participant, 10)
    participant.abort("the grid died")
    assert read_table(tmp_path / "flows.parquet")["sent"].sum() == 150
    assert (tmp_path / "packets.parquet").is_file()


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    """Otherwise no result could be reproduced."""
    first, again = (
        [bundle.to_bytes() for bundle in delivered(open_participant(run, tmp_path), 30)]
        for run in (run_file(tmp_path), run_file(tmp_path))
    )
    assert first == again


@pytest.mark.parametrize(("processing", "lead"), [("16.7 ms", 1), ("51 ms", 3), ("90 ms", 5)])
def test_a_lead_changes_no_byte(tmp_path: Path, processing: str, lead: int) -> None:
    """Otherwise a run would depend on how the federates share their work."""
    text = MINIWECC.read_text(encoding="utf-8")
    assert "pmu: {processing: 88 ms" in text
    topology = tmp_path / "network.yaml"
    topology.write_text(text.replace("pmu: {processing: 88 ms", f"pmu: {{processing: {processing}"))
    sent = []
    for lead_taken in (0, lead):
        folder = tmp_path / str(lead_taken)
        folder.mkdir()
        run = miniwecc_run(topology, lead_taken)
        participant = open_participant(run, folder)
        deliveries = taken_through(participant, Clock(**run["clock"]))
        participant.finish()
        tables = [read_table(path) for path in sorted(folder.glob("*.parquet"))]
        sent.append((deliveries, tables))
    assert sent[0][0] == sent[1][0]
    assert len(sent[0][0]) > 30
    for one, other in zip(sent[0][1], sent[1][1], strict=True):
        assert one.equals(other)


def taken_through(participant: Any, clock: Clock) -> list[tuple[Any, bytes]]:
    """Return each delivery of a whole run with its frame's bytes, meeting by meeting."""
    messages = participant.start()
    since = 0
    for k in [*clock.meetings(), clock.intervals]:
        measured = [
            FrameBundle(clock.at_ns(number), np.full((3, 34), number, np.uint8)).to_bytes()
            for number in range(since, k + 1)
        ]
        messages.append(participant.advance(k, b"".join(measured)))
        since = k + 1
    bundles = [DeliveryBundle.from_bytes(message) for message in messages if message]
    assert [bundle.until_ns for bundle in bundles] == [
        clock.at_ns(clock.next_meeting(k)) for k in clock.meetings()
    ]
    names = ("arrival_ns", "source", "destination", "sequence")
    return [
        (record[list(names)].tolist(), bundle.payloads[record["payload"]].tobytes())
        for bundle in bundles
        for record in bundle.records
    ]


@pytest.mark.parametrize("network", [{}, {"engine": "constant", "delay": 0.25, "topology": None}])
def test_a_lead_beyond_the_lookahead_is_refused_at_the_first_late_frame(tmp_path, network):
    """Otherwise deliveries would be handed over without the frames that belong to them."""
    run = run_file(tmp_path, **network)
    run["clock"]["lead"] = 19
    participant = open_participant(run, tmp_path)
    clock = Clock(**run["clock"])
    with pytest.raises(CosimError, match="came when the network had reached"):
        taken_through(participant, clock)


def miniwecc_run(topology: Path, lead: int) -> dict[str, Any]:
    return {
        "seed": 5,
        "frequency_hz": 60.0,
        "clock": {"rate_hz": 60, "intervals": 12, "lead": lead},
        "network": {"engine": "packet", "topology": str(topology), "loss": 0.02},
        "sources": [{"name": f"pmu{i:02d}", "bus": bus} for i, bus in enumerate((2, 4, 61))],
        "destinations": [
            {"name": f"ctl{i:02d}", "unit": f"G{bus}", "bus": bus} for i, bus in enumerate((1, 118))
        ],
    }
