"""`tieline packet`: the fate of a packet from a result folder alone, checked against its tables."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tieline.cli.app import app
from tieline.cosim.interfaces import Clock, FrameBundle
from tieline.errors import InputError
from tieline.experiment.manifest import random_streams
from tieline.experiment.results import FORMAT
from tieline.fates import Asked, packet_fate
from tieline.fates.lookup import FatesDifferError
from tieline.network.federate import open_participant
from tieline.network.results import PACKET_COLUMNS
from tieline.streams import stream
from tieline.tables import read_table, write_table

TOPOLOGY = """\
link_defaults: {rate: 1 Mbit/s, queue: 2, overhead: 9}
pmu: {processing: 20 ms}
controller: {processing: 1 ms}
nodes:
  a: {buses: [1, 11]}
  b: {buses: [2, 12]}
  c: {buses: [3]}
links:
  - {a: a, b: b, propagation: 2 ms}
  - {a: b, b: c, propagation: 3 ms, loss: 0.1}
cross_traffic:
  - {kind: poisson, from: a, to: c, rate: 700 kbit/s, payload: 200}
"""
SOURCES = [{"name": f"pmu{i:02d}", "bus": bus} for i, bus in enumerate((1, 2, 3))]
DESTINATIONS = [
    {"name": f"ctl{j:02d}", "unit": f"G{j}", "bus": bus} for j, bus in enumerate((11, 12, 3))
]
CUT = [{"at": 1.0, "event": "link_down", "link": ["b", "c"]}]
ENGINES: dict[str, dict[str, Any]] = {
    "unicast": {"events": CUT},
    "multicast": {"transport": "multicast", "events": CUT},
    "tcp": {"transport": "tcp"},
    "empirical": {
        "engine": "empirical",
        "topology": None,
        "loss": 0.1,
        "empirical": {"distribution": {"distribution": "gamma", "mean": 0.08, "deviation": 0.02}},
    },
    "ideal": {"engine": "ideal", "topology": None},
}


def result(folder: Path, engine: str, intervals: int = 90) -> Path:
    """Return the folder of a run of the network alone."""
    folder.mkdir()
    path = folder.parent / "network.yaml"
    path.write_text(TOPOLOGY, encoding="utf-8")
    network = {"engine": "packet", "topology": str(path), "empirical": None, "record_packets": True}
    run = {
        "seed": 3,
        "frequency_hz": 60.0,
        "clock": {"rate_hz": 60, "intervals": intervals, "lead": 0},
        "network": network | ENGINES[engine],
        "wams": {"reporting": 60},
        "sources": SOURCES,
        "destinations": DESTINATIONS,
    }
    inputs = {"topology": hashlib.sha256(path.read_bytes()).hexdigest()}
    manifest = {"format": FORMAT, "kind": "run", "status": "complete", "inputs": inputs}
    manifest |= {"name": "followed", "label": "", "config": {}}
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    participant, clock = open_participant(run, folder), Clock(60, intervals)
    participant.start()
    for k in range(intervals):
        frames = FrameBundle(clock.at_ns(k), np.zeros((3, 34), np.uint8))
        participant.advance(k, frames.to_bytes())
    participant.finish()
    return folder


@pytest.fixture(scope="module", params=list(ENGINES))
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return result(tmp_path_factory.mktemp("fates") / "result", request.param)


def test_packets_of_every_ending_have_the_fate_that_was_recorded(folder: Path) -> None:
    """Otherwise the explanation of a lost packet would explain another run."""
    packets = read_table(folder / "packets.parquet")
    for _, some in packets.groupby("outcome"):
        for _, row in some.iloc[:: max(1, len(some) // 3)].iterrows():
            source, place = divmod(int(row["flow"]), len(DESTINATIONS))
            names = (SOURCES[source]["name"], DESTINATIONS[place]["name"])
            found = packet_fate(folder, Asked(*names, int(row["sequence"])))
            assert len(found.checks) == 2
            assert found.fate.ended_ns == row["ended_ns"]
            assert found.fate.outcome == row["outcome"]


def test_the_manifest_names_every_stream_and_how_much_of_it_was_used(folder: Path) -> None:
    """Otherwise a packet's fate would hang on numbers that nobody could draw again."""
    listed = random_streams(3, folder)["network"]
    names = {name for family in listed for name in family["taken"]}
    told = json.loads((folder / "run.json").read_text(encoding="utf-8"))["network"]
    if told["engine"] == "packet":
        own = {f"loss of {ends}" for ends in ("b->c", "c->b")}
        assert names == {*own, next(name for name in names if name.startswith("arrivals of "))}
    assert (names == set()) == (told["engine"] == "ideal")
    for family in listed:
        assert family["is_seeded"]
        assert all(count > 0 for count in family["taken"].values())


def test_a_drawn_delay_is_the_number_of_its_stream_that_is_named(
    tmp_path: Path,
) -> None:
    """Otherwise the empirical engine's packets could not be traced to the seed."""
    found = packet_fate(result(tmp_path / "result", "empirical", 30), Asked("1", "G0", 7))
    delay, loss = found.fate.draws
    is_lost = stream(3, loss.stream).random(256)[loss.number - 1] < 0.1
    assert is_lost == (found.fate.outcome == 2)
    assert delay.stream == "delay of pmu00->ctl00"


def test_the_command_says_it_in_words_and_as_json(tmp_path: Path) -> None:
    """Otherwise only programmers could ask."""
    folder = result(tmp_path / "result", "unicast", 30)
    words = ["packet", str(folder), "--from", "B2", "--to", "G2", "--sent-at", "100 ms"]
    said = CliRunner().invoke(app, words)
    assert said.exit_code == 0, said.output
    assert "frame 6 of pmu01 (bus 2) to ctl02 (G2)" in said.output
    assert "packets.parquet says the same" in said.output
    data = json.loads(CliRunner().invoke(app, [*words, "--json"]).output)
    assert data["fate"]["measured_ns"] == 100_000_000
    assert [hop["target"] for hop in data["fate"]["hops"]] == ["c"]


def test_what_cannot_be_answered_is_refused(tmp_path: Path) -> None:
    """Otherwise a changed topology, or a wrong table, would give a story that never happened."""
    folder = result(tmp_path / "result", "unicast", 30)
    for asked, words in [
        (Asked("B7", "G2", 1), "--from 'B7'"),
        (Asked("B2", "G7", 1), "--to 'G7'"),
        (Asked("B2", "G2", 30), "0 to 29"),
        (Asked("B2", "G2"), "--sequence"),
    ]:
        with pytest.raises(InputError, match=words):
            packet_fate(folder, asked)
    packets = read_table(folder / "packets.parquet")
    packets["ended_ns"] += 1
    columns = {name: packets[name].to_numpy() for name in packets.columns}
    write_table(folder / "packets.parquet", PACKET_COLUMNS, columns)
    with pytest.raises(FatesDifferError, match=r"packets\.parquet says"):
        packet_fate(folder, Asked("B2", "G2", 6))
    (tmp_path / "network.yaml").write_text(TOPOLOGY + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="has changed since"):
        packet_fate(folder, Asked("B2", "G2", 6))
