"""Experiments with a mistake: each is refused with one clear sentence that names the place."""

import re
from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.experiment.load import load_experiment

GOOD = """\
name: tiny
question: Does it hold?
case: miniwecc
seed: 1
grid:
  duration: 41 s
  pss:
    gain: 9
    beta1: 1
  events:
    - {at: 1 s, trip_generator: G26}
wams:
  reporting: 60
  sensors: [2, 4]
network:
  engine: packet
sweep:
  - {label: a, network.mean_delay: 250 ms}
  - {label: b, network.mean_delay: 500 ms}
"""

JARGON = re.compile(r"pydantic|Traceback|literal\[|constrained|Input should|discriminator|_type\b")

# (what is replaced, by what, line of the finding, words that the finding must hold)
MISTAKES = [
    ("seed: 1", "sed: 1", 4, ["unknown key 'sed'", "'seed'"]),
    ("  duration: 41 s", "  duraton: 41 s", 6, ["unknown key 'duraton' in grid", "'duration'"]),
    ("    gain: 9", "    gane: 9", 8, ["unknown key 'gane' in grid.pss", "'gain'"]),
    ("seed: 1", "duration: 3", 4, ["unknown key 'duration'", "'grid.duration'"]),
    ("seed: 1", "xyzzy: 3", 4, ["unknown key 'xyzzy'", "allowed: name, question, case"]),
    ("seed: 1", "60: 3", 4, ["unknown key '60'"]),
    ("name: tiny", "seed: 2", 4, ["seed", "twice"]),
    ("name: tiny\n", "", 1, ["missing key 'name'", "letters"]),
    ("question: Does it hold?\n", "", 1, ["missing key 'question'", "one sentence"]),
    ("question: Does it hold?", "question: ''", 2, ["question must be not empty"]),
    ("question: Does it hold?", "question: [a]", 2, ["question must be text", "['a']"]),
    ("name: tiny", "name: a b/c", 1, ["name must be letters", "'a b/c'"]),
    ("seed: 1", "seed: -1", 4, ["seed must be 0 or more", "-1"]),
    ("seed: 1", "seed: 1.5", 4, ["seed must be a whole number", "1.5"]),
    ("seed: 1", "seed: true", 4, ["seed must be a whole number", "true"]),
    ("seed: 1", "seed: '1'", 4, ["seed must be a whole number", "'1'"]),
    ("41 s", "41 h", 6, ["grid.duration", "s, ms, us, ns, min", "'41 h'"]),
    ("41 s", "long", 6, ["grid.duration must be a time", "'long'"]),
    ("41 s", "-1 s", 6, ["grid.duration must be greater than 0 s", "'-1 s'"]),
    ("41 s", "0", 6, ["grid.duration must be greater than 0 s"]),
    ("41 s", ".inf", 6, ["grid.duration must be a finite number"]),
    ("41 s", ".nan", 6, ["grid.duration must be"]),
    ("41 s", "", 6, ["grid.duration must be a time"]),
    (
        "41 s",
        "41.001 s",
        6,
        ["grid.duration must be a whole number of reporting intervals", "41 s"],
    ),
    ("gain: 9", "gain: strong", 8, ["grid.pss.gain must be a number", "'strong'"]),
    ("gain: 9", "gain: -9", 8, ["grid.pss.gain must be 0 or more", "-9"]),
    ("gain: 9", "gain: true", 8, ["grid.pss.gain must be a number", "true"]),
    ("beta1: 1", "beta1: 1.2", 9, ["grid.pss.beta1 must be 1 or less", "1.2"]),
    ("gain: 9", "model: generalised", 8, ["none, standard, generalized", "mean 'generalized'"]),
    ("gain: 9", "units: al", 8, ["grid.pss.units must be 'all' or a list", "'all'"]),
    ("gain: 9", "units: [G1, 2]", 8, ["grid.pss.units[1] must be text", "2"]),
    ("gain: 9", "units: [G1, G1]", 8, ["grid.pss.units names G1 twice"]),
    ("  pss:\n    gain: 9\n    beta1: 1", "  pss: 9", 7, ["grid.pss must be a group of keys", "9"]),
    ("at: 1 s", "at: -1 s", 11, ["grid.events[0].at must be 0 s or more", "'-1 s'"]),
    ("at: 1 s, ", "", 11, ["missing key 'grid.events[0].at'"]),
    ("trip_generator: G26", "trip_gen: G26", 11, ["unknown key 'trip_gen'", "'trip_generator'"]),
    ("trip_generator: G26", "trip_generator: 26", 11, ["trip_generator must be text", "26"]),
    ("trip_generator: G26", "trip_generator: G26, bus: 1", 11, ["unknown key 'bus'"]),
    ("{at: 1 s, trip_generator: G26}", "G26", 11, ["events[0] must be a group of keys"]),
    (
        "    - {at: 1 s, trip_generator: G26}",
        "    - {at: 1 s, trip_generator: G26}\n    - {at: 2 s, fault_buss: 86, clear_after: 0.1}",
        12,
        ["fault_buss"],
    ),
    (
        "reporting: 60",
        "reporting: contnuous",
        13,
        ["a whole number or 'continuous'", "'contnuous'"],
    ),
    ("reporting: 60", "reporting: 0", 13, ["wams.reporting must be greater than 0"]),
    ("reporting: 60", "reporting: 70", 13, ["must be a multiple of the 70 reports", "240", "210"]),
    ("reporting: 60", "reporting: continuous", 13, ["needs network.engine ideal or constant"]),
    (
        "sensors: [2, 4]",
        "sensors: [2, two]",
        14,
        ["wams.sensors[1] must be a whole number", "'two'"],
    ),
    ("sensors: [2, 4]", "sensors: [2, 2]", 14, ["wams.sensors names 2 twice"]),
    ("sensors: [2, 4]", "sensors: []", 14, ["wams.sensors must be", "not empty"]),
    ("[2, 4]", "[2, 4]\n  weights: [1]", 15, ["one weight for each of the 2 sensors"]),
    ("[2, 4]", "[2, 4]\n  weights: [0, 0]", 15, ["wams.weights must not all be 0"]),
    ("[2, 4]", "[2, 4]\n  weights: [1, -1]", 15, ["wams.weights[1] must be 0 or more"]),
    ("  duration: 41 s", "  steps_per_second: 250", 13, ["must be a multiple of the 60 reports"]),
    ("  duration: 41 s", "  records_per_second: 70", 6, ["must divide", "70", "60 would do"]),
    ("engine: packet", "engine: ns33", 16, ["ideal, constant, empirical", "'ns33'"]),
    ("engine: packet", "engine: pakcet", 16, ["network.engine must be one of", "mean 'packet'"]),
    (
        "engine: packet",
        "engine: packet\n  delay: 1 s",
        17,
        ["network.delay has no effect", "constant"],
    ),
    ("engine: packet", "loss: 1", 16, ["network.loss must be less than 1"]),
    ("engine: packet", "loss: 2 km", 16, ["network.loss must be a share in one of %", "'2 km'"]),
    ("engine: packet", "loss: some", 16, ["network.loss must be a number, or a share", "'some'"]),
    ("engine: packet", "record_packets: 1", 16, ["network.record_packets must be true or false"]),
    ("engine: packet", "delay: 5 km", 16, ["network.delay must be a time", "'5 km'"]),
    (
        "wams:",
        "federation: {core: zeromq}\nwams:",
        12,
        ["federation.core must be one of zmq", "zmq"],
    ),
    ("label: b", "label: A", 19, ["label 'A' is taken by point 'a'"]),
    ("{label: b, ", "{", 19, ["sweep[1] needs a label"]),
    ("label: b", "label: '!'", 19, ["sweep[1] needs a label"]),
    ("500 ms}", "500 ms, network.losss: 0}", 19, ["point 'b': unknown key 'losss'", "'loss'"]),
    ("500 ms}", "-1}", 19, ["point 'b': network.mean_delay must be greater than 0", "-1"]),
    (
        "500 ms}",
        "500 ms, network.engine: ideal}",
        19,
        ["network.mean_delay has no effect", "ideal"],
    ),
    ("network.mean_delay: 500 ms", "network: {loss: 0}", 19, ["one setting a key", "network.loss"]),
    ("network.mean_delay: 500 ms", "name: b", 19, ["a sweep point cannot change 'name'"]),
    ("network.mean_delay: 500 ms", "seed.x: 1", 19, ["'seed' is a single value"]),
    ("{label: b, network.mean_delay: 500 ms}", "b", 19, ["sweep[1] must be a group of keys"]),
    (
        GOOD[GOOD.index("sweep:") :],
        "sweep: twice",
        17,
        ["sweep must be a list of points", "'twice'"],
    ),
    ("  engine: packet", "  engine: [packet", 17, ["expected"]),
    ("  engine: packet", "\tengine: packet", 16, ["cannot start any token"]),
    (GOOD, "- a\n", 1, ["an experiment must be a group of keys"]),
    (GOOD, "", 1, ["missing key 'name'"]),
]


def findings_of(tmp_path: Path, text: str, *settings: str) -> tuple[str, ...]:
    """Return what is found wrong with an experiment."""
    path = tmp_path / "tiny.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_experiment(str(path), settings)
    return caught.value.findings


@pytest.mark.parametrize(("old", "new", "line", "words"), MISTAKES, ids=lambda v: str(v)[:40])
def test_a_mistake_is_named_with_its_line(
    tmp_path: Path, old: str, new: str, line: int, words: list[str]
) -> None:
    """Otherwise a user would search a file for what the program already knew."""
    assert GOOD.count(old) >= 1
    findings = findings_of(tmp_path, GOOD.replace(old, new, 1))
    matching = [finding for finding in findings if all(word in finding for word in words)]
    assert len(matching) == 1, findings
    assert f"tiny.yaml:{line}: " in matching[0], matching
    assert not any(JARGON.search(finding) for finding in findings), findings


def test_the_experiment_that_the_mistakes_start_from_is_sound(tmp_path: Path) -> None:
    """Otherwise the refusals above could have another reason."""
    path = tmp_path / "tiny.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert [point.label for point in load_experiment(str(path)).points] == ["a", "b"]


def test_all_findings_come_in_one_message(tmp_path: Path) -> None:
    """Otherwise a file with five mistakes would take five attempts."""
    text = GOOD.replace("seed: 1", "sed: 1").replace("41 s", "-1 s").replace("packet", "ns4", 1)
    text = text.replace("500 ms", "never")
    findings = findings_of(tmp_path, text, "grid.pss.gain=x")
    places = [re.sub(r".*tiny\.yaml", "tiny.yaml", finding).split(": ")[0] for finding in findings]
    assert places == ["--set grid.pss.gain=x", *(f"tiny.yaml:{line}" for line in (4, 6, 16, 19))]


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    """Otherwise a result given in place of an experiment would end in a decoder's traceback."""
    path = tmp_path / "binary.yaml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        load_experiment(str(path))


def test_an_unknown_name_lists_the_shipped_ones_and_the_nearest() -> None:
    """Otherwise a typing mistake would send the user to the documentation."""
    with pytest.raises(InputError, match=r"did you mean 'g26_trip'.*g26_trip_beta2"):
        load_experiment("g26_trp")
