"""Experiments that extend others."""

from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.experiment.load import Study, load_experiment

BASE = """\
name: base
question: Does it hold?
seed: 3
grid:
  duration: 41 s
  pss: {gain: 9, beta1: 1}
  events:
    - {at: 1 s, trip_generator: G26}
    - {at: 2 s, trip_generator: G1}
network:
  queue: {discipline: drop_tail, packets: 20}
sweep:
  - {label: a, network.mean_delay: 250 ms}
"""
CHILD = """\
extends: base
name: child
grid:
  pss: {beta1: 0.5}
  events:
    - {at: 3 s, trip_generator: G2}
network:
  queue: {discipline: red, packets: 50, low: 5, high: 15}
sweep: []
"""


def study(tmp_path: Path, child: str, base: str = BASE, *settings: str) -> Study:
    """Return the study of an experiment that may extend `base`."""
    (tmp_path / "base.yaml").write_text(base, encoding="utf-8")
    (tmp_path / "child.yaml").write_text(child, encoding="utf-8")
    return load_experiment(str(tmp_path / "child.yaml"), settings)


def refusal(tmp_path: Path, child: str, base: str = BASE) -> tuple[str, ...]:
    """Return what is found wrong."""
    with pytest.raises(InputError) as caught:
        study(tmp_path, child, base)
    return tuple(finding.replace(f"{tmp_path}/", "") for finding in caught.value.findings)


def test_a_file_changes_what_it_says_and_keeps_the_rest(tmp_path: Path) -> None:
    """Otherwise a variant of an experiment would have to be a copy of it."""
    found = study(tmp_path, CHILD)
    experiment = found.base
    assert (experiment.name, experiment.question, experiment.seed) == ("child", "Does it hold?", 3)
    assert (experiment.grid.pss.gain, experiment.grid.pss.beta1) == (9, 0.5)
    assert [event.at for event in experiment.grid.events] == [3.0]
    assert experiment.network.queue is not None
    assert experiment.network.queue.discipline == "red"
    assert not found.is_sweep


def test_a_sweep_is_inherited(tmp_path: Path) -> None:
    """Otherwise a variant of a study would lose its points."""
    (point,) = study(tmp_path, "extends: base.yaml\nname: child\n").points
    assert (point.label, point.experiment.network.mean_delay) == ("a", 0.25)


def test_a_chain_ends_at_a_shipped_name(tmp_path: Path) -> None:
    """Otherwise only one's own files could be varied."""
    base = "extends: g26_trip\nname: base\ngrid: {duration: 5 s}\n"
    found = study(tmp_path, "extends: base\nname: child\nseed: 9\n", base)
    assert (found.base.grid.duration, found.base.seed, len(found.points)) == (5.0, 9, 6)
    assert [document.path.stem for document in found.sources.layers.documents] == [
        "child",
        "base",
        "g26_trip",
    ]


def test_a_setting_can_be_taken_back(tmp_path: Path) -> None:
    """Otherwise a delay of the base could not be undone."""
    base = BASE.replace("network:", "network:\n  mean_delay: 1 s")
    child = "extends: base\nname: child\nnetwork: {mean_delay: null, queue: null}\nsweep: []\n"
    network = study(tmp_path, child, base).base.network
    assert (network.mean_delay, network.queue) == (None, None)


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("gain: 9", "gane: 9", "base.yaml:6: unknown key 'gane' in grid.pss"),
        ("41 s", "41 h", "base.yaml:5: grid.duration must be a time"),
        ("250 ms", "never", "base.yaml:13: point 'a': network.mean_delay must be a time"),
        ("seed: 3", "sed: 3", "base.yaml:3: unknown key 'sed'"),
        ("at: 2 s, ", "", "base.yaml:9: missing key 'grid.events[1].at'"),
    ],
)
def test_a_mistake_is_told_of_the_file_that_makes_it(
    tmp_path: Path, old: str, new: str, finding: str
) -> None:
    """Otherwise one would search the wrong file."""
    (found,) = refusal(tmp_path, "extends: base\nname: child\n", BASE.replace(old, new))
    assert found.startswith(finding)


def test_a_mistake_in_what_is_replaced_is_told_of_the_upper_file(tmp_path: Path) -> None:
    """Otherwise line numbers of one file would be given with the other's name."""
    findings = refusal(tmp_path, CHILD.replace("at: 3 s, ", "").replace("beta1: 0.5", "beta1: 2"))
    assert [finding.split(": ")[0] for finding in findings] == ["child.yaml:4", "child.yaml:6"]


@pytest.mark.parametrize(
    ("child", "finding"),
    [
        ("name: c\nextends: bse\n", "child.yaml:2: extends no experiment 'bse'"),
        ("name: c\nextends: g26_trp\n", "child.yaml:2: extends no experiment 'g26_trp'; did you"),
        ("name: c\nextends: 3\n", "child.yaml:2: extends must be a file or a shipped name"),
        ("name: c\nextends: child\n", "child.yaml:2: extends leads back to itself (child.yaml ->"),
        ("extends: base\n", "child.yaml:1: missing key 'name'"),
    ],
)
def test_a_base_that_cannot_be_is_refused(tmp_path: Path, child: str, finding: str) -> None:
    """Otherwise an experiment could extend nothing, or itself for ever."""
    (found,) = refusal(tmp_path, child)
    assert found.startswith(finding)


def test_a_longer_loop_is_refused(tmp_path: Path) -> None:
    """Otherwise two files that extend each other would be read for ever."""
    (found,) = refusal(tmp_path, "extends: base\nname: child\n", f"extends: child\n{BASE}")
    assert found.startswith("base.yaml:1: extends leads back to itself (child.yaml -> base.yaml")


def test_extends_is_no_option(tmp_path: Path) -> None:
    """Otherwise `--set extends=...` would be ignored without a word."""
    with pytest.raises(InputError, match="only a file can say 'extends'"):
        study(tmp_path, CHILD, BASE, "extends=g26_trip")


def test_files_count_from_the_file_that_names_them(tmp_path: Path) -> None:
    """Otherwise a base could not be used from another folder with its own network."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "net.yaml").write_text("nodes: {}\n")
    base = BASE.replace("network:", "network:\n  topology: net.yaml")
    (tmp_path / "lib" / "far.yaml").write_text(base)
    found = study(tmp_path, "extends: lib/far.yaml\nname: child\nsweep: []\n")
    assert found.base.network.topology == str(tmp_path / "lib" / "net.yaml")
