"""Experiments from Python: the settings that reach them, what is refused, where results go."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tieline
from synthetic_result import EXPERIMENT, SWEEP, fake_launch, known_sites
from tieline.api import running
from tieline.api.settings import options
from tieline.experiment import plan
from tieline.experiment.sweep_run import InTurn

ENGINE: dict[str, Any] = {"network.engine": "constant", "network.delay": "250 ms"}


@pytest.fixture(autouse=True)
def _no_federation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Stand in for case, network and launcher; each test works in a folder of its own."""
    monkeypatch.setattr(plan.prepare, "__defaults__", (known_sites,))
    monkeypatch.setattr(running, "launch", fake_launch)
    monkeypatch.setattr(running, "runner_of", lambda plan, jobs, scheduler: InTurn(fake_launch))
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(EXPERIMENT)
    Path("swept.yaml").write_text(EXPERIMENT + SWEEP)


def test_settings_are_taken_dotted_and_nested() -> None:
    """Otherwise a notebook would need other words than the file and the command line."""
    experiment = tieline.load("tiny.yaml", ENGINE, grid={"pss": {"gain": 7, "beta1": 0.5}}, seed=4)
    (settings,) = experiment.settings.values()
    assert settings["grid"]["pss"]["gain"] == 7
    assert settings["grid"]["pss"]["beta1"] == 0.5
    assert settings["network"]["delay"] == 0.25
    assert settings["seed"] == 4
    assert settings["grid"]["duration"] == 41


@pytest.mark.parametrize("value", [1e-5, 3, True, None, "250 ms", [1.5, 2], {}, "a: b # c", "1e3"])
def test_a_value_means_the_same_in_an_option_as_in_python(value: Any) -> None:
    """YAML reads 1e-05 as a word and `yes` as a truth: a setting would silently be another."""
    import yaml

    (option,) = options({"key": value})
    assert yaml.safe_load(option.removeprefix("key=")) == value


def test_numbers_of_numpy_are_numbers() -> None:
    """Values of a sweep come out of linspace."""
    assert options({"a": np.float64(0.25), "b": np.int64(3), "c": np.arange(2)}) == [
        "a=0.25",
        "b=3",
        "c=[0, 1]",
    ]


def test_what_no_file_could_hold_is_refused() -> None:
    """Otherwise an object's address would become the setting."""
    with pytest.raises(tieline.InputError, match=r"a\.b must be a number, text, list"):
        options({"a": {"b": object()}})


def test_a_dictionary_is_an_experiment() -> None:
    """Otherwise an experiment made in a notebook would need a file."""
    content = {
        "name": "own",
        "question": "Does it?",
        "case": "miniwecc",
        "grid": {"duration": "5 s"},
    }
    experiment = tieline.load(content, ENGINE)
    assert experiment.labels == ["own"]
    assert experiment.settings["own"]["grid"]["duration"] == 5
    assert "Does it?" in experiment._repr_html_()


def test_a_mistake_is_named_by_its_key_and_in_no_file_that_the_user_never_saw() -> None:
    """Otherwise the message would send the reader to a temporary file or to a command's option."""
    with pytest.raises(tieline.InputError) as error:
        tieline.load({"name": "own", "question": "?", "case": "miniwecc", "gird": {}})
    assert str(error.value).startswith("unknown key 'gird'")
    with pytest.raises(tieline.InputError) as error:
        tieline.load("tiny.yaml", {"grid.duraton": 3})
    assert str(error.value).startswith("grid.duraton=3: unknown key 'duraton'")


def test_a_run_gives_its_result() -> None:
    """Otherwise there would be nothing to look at."""
    result = tieline.run("tiny.yaml", ENGINE, out="out")
    assert result.folder == Path("out")
    assert result.is_complete
    assert result.table().loc["tiny", "delay_mean_s"] == pytest.approx(0.25)


def test_runs_of_one_second_do_not_replace_each_other() -> None:
    """A loop over tunings would keep the last result alone."""
    results = [tieline.run("tiny.yaml", ENGINE) for _ in range(3)]
    assert len({result.folder for result in results}) == 3
    assert all(result.folder.is_dir() for result in results)


def test_progress_is_told_by_run_and_time(capsys: pytest.CaptureFixture[str]) -> None:
    """Otherwise a long sweep would look like a hung kernel."""
    heard: list[tuple[str, float]] = []
    tieline.run("swept.yaml", out="a", progress=lambda label, t_s: heard.append((label, t_s)))
    assert heard == [("ideal", 20.5), ("ideal", 41.0), ("0.25 s", 20.5), ("0.25 s", 41.0)]
    assert capsys.readouterr().out == ""
    tieline.run("tiny.yaml", ENGINE, out="b", progress=True)
    assert capsys.readouterr().out == "tiny: 20.5 of 41 s\ntiny: 41.0 of 41 s\n"


def test_what_is_shipped_is_listed() -> None:
    """Otherwise a newcomer could not know what there is to run."""
    assert "Alberta" in tieline.cases().loc["miniwecc", "title"]
    assert tieline.experiments().loc["g26_trip", "question"].endswith("?")


def test_a_group_that_is_one_thing_is_replaced_and_a_sweep_is_a_block() -> None:
    """Otherwise a queue of one kind would keep words of another, and no block could be given."""
    stated = options({"network": {"queue": {"discipline": "red", "packets": 50}}})
    assert [text.partition("=")[0] for text in stated] == ["network.queue"]
    block = {"method": "grid", "over": {"grid.pss.gain": [1, 2]}}
    assert [text.partition("=")[0] for text in options({"sweep": block})] == ["sweep"]
