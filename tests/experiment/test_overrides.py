"""Settings given on the command line."""

from pathlib import Path

import pytest

from synthetic_result import EXPERIMENT, SWEEP
from tieline.errors import InputError
from tieline.experiment.load import Study, load_experiment
from tieline.experiment.overrides import Override, apply, parse_settings, path_of

BAD_SETTINGS = [
    ("network.delay", ["must be key=value"]),
    ("=3", ["must be key=value"]),
    ("grid..pss=3", ["must be key=value"]),
    ("grid.pss.gain={", ["is no YAML"]),
    ("grid.duraton=3", ["unknown key 'duraton'", "'duration'"]),
    ("network.delay=5 h", ["network.delay must be a time", "'5 h'"]),
    ("grid.events.0.at=soon", ["grid.events[0].at must be a time", "'soon'"]),
    ("grid.events.4.at=1", ["'grid.events' is a list of 1", "from 0 to 0"]),
    ("grid.events.first.at=1", ["'grid.events' is a list of 1"]),
    ("name.first=x", ["'name' is a single value"]),
    ("grid=3", ["grid must be a group of keys", "3"]),
    ("network.engine=constant", ["network.engine constant needs network.delay"]),
    ("network.engine=helics-filters", ["network.engine helics-filters needs network.delay"]),
    ("network.engine=empirical", ["network.engine empirical needs network.empirical"]),
    ("network.empirical={}", ["must have either a 'trace' or a 'distribution'"]),
    ("wams.reporting=continuous", ["needs network.engine ideal or constant"]),
]


def study(tmp_path: Path, text: str, *settings: str) -> Study:
    """Return the study of a text with settings put over it."""
    path = tmp_path / "tiny.yaml"
    path.write_text(text, encoding="utf-8")
    return load_experiment(str(path), settings)


@pytest.mark.parametrize(("setting", "words"), BAD_SETTINGS)
def test_a_bad_setting_is_located_at_itself(tmp_path: Path, setting: str, words: list[str]) -> None:
    """Otherwise the user would look for the mistake in a file that is right."""
    with pytest.raises(InputError) as caught:
        study(tmp_path, EXPERIMENT, setting)
    (finding,) = caught.value.findings
    assert finding.startswith(f"--set {setting}: ")
    assert all(word in finding for word in words), finding


def test_settings_are_typed_like_the_file(tmp_path: Path) -> None:
    """Otherwise `--set` would mean another experiment than the same words in a file."""
    settings = ("network.mean_delay=250ms", "grid.events.0.at=0.5 s", "wams.sensors=[2, 4]")
    experiment = study(tmp_path, EXPERIMENT, *settings).points[0].experiment
    assert experiment.network.mean_delay == 0.25
    assert experiment.grid.events[0].at == 0.5
    assert experiment.wams.sensors == [2, 4]


def test_the_last_of_equal_settings_holds(tmp_path: Path) -> None:
    """Otherwise a setting put after another in a script would be lost."""
    experiment = study(tmp_path, EXPERIMENT, "seed=2", "seed=3").points[0].experiment
    assert experiment.seed == 3


def test_a_setting_that_the_sweep_overrides_is_refused(tmp_path: Path) -> None:
    """Otherwise a run would ignore what the user asked for, without a word."""
    with pytest.raises(InputError, match=r"the sweep itself sets network.delay; add --set sweep="):
        study(tmp_path, EXPERIMENT + SWEEP, "network.delay=1 s")


def test_an_emptied_sweep_leaves_one_run(tmp_path: Path) -> None:
    """Otherwise the advice that the message gives would not work."""
    found = study(tmp_path, EXPERIMENT + SWEEP, "sweep=[]", "network.mean_delay=1 s")
    assert not found.is_sweep
    assert [point.experiment.network.mean_delay for point in found.points] == [1.0]


def test_applying_leaves_the_original_alone() -> None:
    """Otherwise one point of a sweep would change the next."""
    data = {"grid": {"pss": {"gain": 9}}, "list": [{"a": 1}]}
    changed, findings = apply(
        data,
        [
            Override(("grid", "pss", "gain"), 5, ""),
            Override(("network", "engine"), "ideal", ""),
            Override(("list", 0, "a"), 2, ""),
        ],
    )
    assert changed == {
        "grid": {"pss": {"gain": 5}},
        "network": {"engine": "ideal"},
        "list": [{"a": 2}],
    }
    assert data == {"grid": {"pss": {"gain": 9}}, "list": [{"a": 1}]}
    assert not findings


def test_every_bad_setting_is_reported_at_once() -> None:
    """Otherwise a command with two mistakes would take two attempts."""
    overrides, findings = parse_settings(["a", "b=1", "c={"])
    assert [override.path for override in overrides] == [("b",)]
    assert len(findings) == 2


def test_whole_numbers_in_a_key_are_places() -> None:
    """Otherwise an event of a list could not be changed."""
    assert path_of("grid.events.0.at") == ("grid", "events", 0, "at")
