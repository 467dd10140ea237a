"""Every reader of tieline against inputs that nobody thought of; see docs/fuzzing.md.

What the longer searches have found stands here, too, in plain words.
"""

import socket
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fuzz import cases, experiments, frames, payloads, results, topologies
from tieline import yaml_lines
from tieline.c37118.batch import Verdict, decode_frames, encode_frames
from tieline.c37118.config import ConfigFrame, PhasorChannel, PmuConfig
from tieline.c37118.constants import FormatBit
from tieline.c37118.data import DataFrame, PmuData
from tieline.c37118.prefix import Prefix
from tieline.errors import CosimError, InputError
from tieline.experiment.desk import Wire
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.experiment.results import read_runs
from tieline.grid.case import load_case
from tieline.network.jitter.empirical import read_sample
from tieline.network.path_delays import read_trace as read_delays
from tieline.network.settings import NetworkSettings
from tieline.network.topology import read_topology
from tieline.network.traffic.trace import read_trace
from tieline.wams import WideAreaAverage

INPUTS = st.binary(min_size=2, max_size=120)

TARGETS = [
    (experiments.one_input, 60),
    (cases.one_input, 40),
    (topologies.one_input, 60),
    (frames.one_input, 400),
    (payloads.one_input, 400),
    (results.one_input, 200),
]


@pytest.mark.parametrize(
    ("one_input", "count"), TARGETS, ids=[target.__module__ for target, _ in TARGETS]
)
def test_no_input_ends_in_anything_but_a_clean_error(
    one_input: Callable[[bytes], None], count: int
) -> None:
    """A traceback tells the user nothing, and in a federation it ends everybody's run."""
    quiet = [HealthCheck.too_slow, HealthCheck.data_too_large]
    search = settings(max_examples=count, deadline=None, suppress_health_check=quiet)
    search(given(INPUTS)(one_input))()


@pytest.mark.parametrize(
    "text",
    ["[" * 50_000, "{a: " * 50_000, "- " * 50_000 + "x", "? " * 50_000, "[" * 500 + "]" * 500],
    ids=["brackets", "groups", "dashes", "keys", "closed"],
)
def test_a_file_of_brackets_is_refused_at_once(tmp_path: Path, text: str) -> None:
    """libYAML's recursion ran over the end of its stack and killed the process without a word."""
    path = tmp_path / "deep.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=r"deep.yaml:1: is nested more than 100 groups deep"):
        yaml_lines.load(path)


def test_a_file_may_be_as_deep_as_anybody_writes_one(tmp_path: Path) -> None:
    """A limit must not be met by a sound file."""
    path = tmp_path / "deep.yaml"
    path.write_text("[" * 100 + "]" * 100)
    yaml_lines.load(path)


@pytest.mark.parametrize("number", ["0x" + "f" * 5_000, "1:" * 2_000 + "1", "-0b" + "1" * 20_000])
def test_a_whole_number_that_cannot_even_be_printed_is_refused(tmp_path: Path, number: str) -> None:
    """Python does not print integers of some thousand digits, so the message itself failed."""
    path = tmp_path / "huge.yaml"
    path.write_text(f"name: x\nseed: {number}\n")
    with pytest.raises(InputError, match=r"huge.yaml:2: '.*' is a whole number beyond 64 bits"):
        load_experiment(str(path))


@pytest.mark.parametrize(
    "kind", ["[poisson, poisson]", "{a: 1}", "[]"], ids=["list", "group", "nothing"]
)
def test_traffic_whose_kind_is_no_word_is_refused(tmp_path: Path, kind: str) -> None:
    """A list where a word belongs was looked up as a key."""
    text = f"extends: g26_trip_smoke\nname: x\nnetwork: {{traffic: [{{kind: {kind}}}]}}\n"
    (tmp_path / "x.yaml").write_text(text)
    with pytest.raises(InputError, match=r"x.yaml:3: network.traffic.0.kind: unknown kind"):
        load_experiment(str(tmp_path / "x.yaml"))


def test_a_link_whose_end_is_no_word_is_refused(tmp_path: Path) -> None:
    """A group where a node's name belongs was looked up as a key."""
    path = tmp_path / "network.yaml"
    path.write_text("nodes: {a: , b: }\nlinks: [{a: {b: c}, b: b, propagation: 1 ms}]\n")
    with pytest.raises(InputError, match=r"network.yaml:2: links.0.a must be a valid string"):
        read_topology(path, [], [], NetworkSettings())


def test_a_number_among_the_keys_of_a_group_is_refused(tmp_path: Path) -> None:
    """The number was taken for a place in a list, and the message about it failed."""
    text = "extends: g26_trip_smoke\nname: x\ngrid: {events: [null], 0: 21 s}\n"
    (tmp_path / "x.yaml").write_text(text)
    with pytest.raises(InputError, match=r"x.yaml:3: "):
        load_experiment(str(tmp_path / "x.yaml"))


ENTRIES = (
    'extends: "{}"',
    'extends: g26_trip_smoke\ncase: "{}"',
    'extends: g26_trip_smoke\nnetwork: {{topology: "{}"}}',
    'extends: g26_trip_smoke\nnetwork: {{engine: empirical, empirical: {{trace: "{}"}}}}',
    'extends: g26_trip_smoke\ngrid: {{pss: {{file: "{}"}}}}',
    "extends: g26_trip_smoke\n"
    'network: {{traffic: [{{kind: trace, from: S101, to: S105, file: "{}"}}]}}',
)


@pytest.mark.parametrize("name", ["a\\0b", "../../..", "/dev/zero", "x" * 5_000], ids=range(4))
@pytest.mark.parametrize("entry", ENTRIES, ids=range(len(ENTRIES)))
def test_strange_paths_are_refused_wherever_one_may_stand(
    tmp_path: Path, entry: str, name: str
) -> None:
    """A long name ended in a traceback, and `/dev/zero` as a trace was read until memory ended."""
    (tmp_path / "x.yaml").write_text("name: x\n" + entry.format(name) + "\n")
    with pytest.raises(InputError):
        prepare(load_experiment(str(tmp_path / "x.yaml")))


def test_a_device_in_the_place_of_a_file_is_refused(tmp_path: Path) -> None:
    """A symbolic link to a device has no end."""
    for name in ("case.yaml", "bus.csv"):
        (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(InputError, match=r"bus.csv: cannot be read \(it is a device or a pipe\)"):
        load_case(tmp_path)


@pytest.mark.parametrize("read", [read_trace, read_sample, lambda p: read_delays(p, [], [])])
def test_a_table_with_an_endless_cell_is_refused(tmp_path: Path, read: Callable) -> None:
    """Python's reader of tables gives up at 131,072 characters, with an error of its own."""
    path = tmp_path / "x.csv"
    path.write_text("time_s,payload_bytes,delay_s\n" + "1" * 200_000 + ",1,1\n")
    if read not in (read_trace, read_sample):
        path.write_text("delay_s\n" + "1" * 200_000 + "\n")
    with pytest.raises((InputError, ValueError), match="field larger than field limit"):
        read(path)


@pytest.mark.parametrize("content", [b"name: \xff\xfe\n", b"name: a\0b\n", b"\xed\xa0\x80: 1\n"])
def test_bytes_that_are_no_text_are_refused(tmp_path: Path, content: bytes) -> None:
    """Files come from other systems, in other encodings, or cut in the middle."""
    (tmp_path / "x.yaml").write_bytes(content)
    with pytest.raises(InputError, match=r"not UTF-8|unacceptable character"):
        load_experiment(str(tmp_path / "x.yaml"))


def test_a_message_does_not_repeat_what_fills_a_file(tmp_path: Path) -> None:
    """A finding of megabytes hides all the others."""
    (tmp_path / "x.yaml").write_text(f"extends: g26_trip_smoke\nsweep: [{'x' * 100_000}]\n")
    with pytest.raises(InputError) as caught:
        load_experiment(str(tmp_path / "x.yaml"))
    assert max(map(len, caught.value.findings)) < 2_100
    assert len(InputError("y" * 10**6).findings[0]) < 2_100


def test_a_link_to_itself_is_no_endless_case(tmp_path: Path) -> None:
    """A symbolic link may lead anywhere, also nowhere."""
    (tmp_path / "case.yaml").symlink_to("case.yaml")
    with pytest.raises(InputError, match="cannot be read"):
        load_case(tmp_path)


@pytest.mark.parametrize("angle", [float("inf"), float("nan")])
def test_a_polar_phasor_with_an_infinite_angle_is_no_measurement(angle: float) -> None:
    """Somebody else's PMU may send one; the decoder failed in the mathematics of angles."""
    form = FormatBit.POLAR | FormatBit.FLOAT_PHASORS | FormatBit.FLOAT_FREQ
    pmu = PmuConfig("Station A", 7, form, (PhasorChannel("VA"),))
    config = ConfigFrame(Prefix(7, 0, 0), (pmu,), 60)
    sound = DataFrame(Prefix(7, 0, 0), (PmuData(0, (1 + 0j,), 60.0, 0.0),)).to_bytes(config)
    words = np.array([1.0, angle], ">f4").tobytes()
    spoilt = sound[:16] + words + sound[24:-2]
    spoilt += frames.crc_of(spoilt).to_bytes(2, "big")
    [phasor] = DataFrame.from_bytes(spoilt, config).pmus[0].phasors
    assert phasor != phasor


def test_a_signalling_nan_is_no_frequency() -> None:
    """Any bits may stand where a frequency is; NumPy warns of these when it widens them."""
    row = encode_frames([7], 0, np.ones(1), 60.0, 0.0)
    row[0, 24:28] = (0x7F, 0x80, 0, 1)
    row[0, -2:] = np.frombuffer(frames.crc_of(row[0, :-2].tobytes()).to_bytes(2, "big"), np.uint8)
    _, verdicts = decode_frames(row)
    assert verdicts.tolist() == [Verdict.NO_FREQUENCY]
    belief = WideAreaAverage(1, [7])
    belief.deliver(row, np.zeros(1, int), np.zeros(1, int))
    assert belief.wbar_pu.tolist() == [1.0]


def test_brackets_on_the_wire_between_hosts_end_the_connection() -> None:
    """Whoever connects to a waiting broker may send what it likes."""
    listener = socket.create_server(("127.0.0.1", 0))
    with listener, socket.create_connection(listener.getsockname()) as theirs:
        wire = Wire(listener.accept()[0])
        theirs.sendall(b"[" * 100_000 + b"\n")
        with pytest.raises(CosimError, match="something came that is not tieline's"):
            wire.wait(10.0)
        wire.close()


@pytest.mark.parametrize(
    "manifest",
    [
        "{}",
        '{"kind": "sweep"}',
        '{"kind": "sweep", "status": "x", "name": "x", "points": [{"slug": "../../etc"}]}',
        '{"kind": "sweep", "status": "x", "name": "x", "points": [7]}',
        '{"kind": ["run"], "status": "x", "name": "x"}',
        '{"kind": "run", "status": "x", "name": "x", "label": 1, "config": {}}',
    ],
)
def test_a_damaged_manifest_is_refused(tmp_path: Path, manifest: str) -> None:
    """A result that somebody sent may be cut, edited, or lead out of its own folder."""
    text = '{"format": "tieline-result/1"' + manifest.replace("{", ", ", 1).replace(", }", "}", 1)
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=r"manifest.json: is damaged"):
        read_runs(tmp_path)


def test_a_manifest_of_brackets_is_no_result(tmp_path: Path) -> None:
    """JSON, too, is read by recursion."""
    (tmp_path / "manifest.json").write_text("[" * sys.getrecursionlimit() * 50)
    with pytest.raises(InputError, match="is no result folder"):
        read_runs(tmp_path)
