"""The command line around sweeps and for scripts: resume, JSON, quiet, compare, plot, doctor."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from synthetic_result import CONSTANT, EXPERIMENT, SWEEP, fake_launch, known_sites, nothing_drawn
from tieline import cli, doctor
from tieline.cli import run as run_command
from tieline.cli.options import shipped_names
from tieline.doctor import Finding
from tieline.errors import CosimError
from tieline.experiment import artist, plan
from tieline.experiment.results import read_manifest
from tieline.experiment.sweep_run import InTurn
from tieline.sweeps import start
from tieline.sweeps.local import LocalPool

SETTINGS = [part for setting in CONSTANT for part in ("--set", setting)]


@pytest.fixture(autouse=True)
def _no_federation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Stand in for case, network, launcher and figures; each test works in a folder of its own."""
    monkeypatch.setattr(plan.prepare, "__defaults__", (known_sites,))
    monkeypatch.setattr(run_command, "launcher", lambda: fake_launch)
    monkeypatch.setattr(run_command, "steps", lambda core: ((), ()))
    monkeypatch.setattr(run_command, "sweep_runner", lambda *_: InTurn(fake_launch))
    monkeypatch.setattr(artist, "_what_draws", lambda: nothing_drawn)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(EXPERIMENT)
    Path("swept.yaml").write_text(EXPERIMENT + SWEEP)


@pytest.fixture
def fail_at(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, BaseException], None]:
    """Return a function that makes one point of the sweep end with an error."""

    def use(slug: str, error: BaseException) -> None:
        def launch(folder: Path, on_progress: Any) -> Any:
            if f"-{slug}-" in json.loads((folder / "run.json").read_text())["run_id"]:
                raise error
            return fake_launch(folder, on_progress)

        monkeypatch.setattr(run_command, "sweep_runner", lambda *_: InTurn(launch))

    return use


def call(*arguments: str) -> Result:
    """Return what a command line gives."""
    return CliRunner().invoke(cli.app, list(arguments))


def test_a_sweep_with_a_failed_point_shows_the_others_and_names_it(fail_at: Any) -> None:
    """Otherwise a script would take it for whole, or its user lose the rest."""
    fail_at("0.25-s", CosimError("lost"))
    result = call("sweep", "swept.yaml", "--out", "out")
    assert result.exit_code == CosimError.exit_code
    assert "59.766" in result.stdout
    assert "1 of 2 points failed" in result.stderr
    assert "  0.25 s: lost" in result.stderr
    assert "Traceback" not in result.output


def test_an_interrupted_sweep_says_how_to_go_on_and_does(fail_at: Any) -> None:
    """Otherwise its user would begin again."""
    fail_at("0.25-s", KeyboardInterrupt())
    result = call("sweep", "swept.yaml", "--out", "out", "--set", "grid.duration=30 s")
    assert result.exit_code == 130
    assert "go on with: tieline sweep --resume out" in result.stderr
    fail_at("nowhere", KeyboardInterrupt())
    result = call("sweep", "--resume", "out")
    assert result.exit_code == 0, result.output
    assert "1 of 2 points were finished before" in result.stdout
    assert "[2/2] 0.25 s: complete" in result.stdout
    config = read_manifest(Path("out/points/0.25-s"))["config"]
    assert config["grid"]["duration"] == 30.0


def test_a_script_gets_one_json_object(fail_at: Any) -> None:
    """Otherwise it would have to read tables made for people."""
    result = call("run", "tiny.yaml", *SETTINGS, "--out", "out", "--json")
    answer = json.loads(result.stdout)
    assert (answer["folder"], answer["status"], answer["reason"]) == ("out", "complete", None)
    assert answer["summary"]["frequency"]["nadir_hz"] == pytest.approx(59.766, abs=1e-3)
    fail_at("0.25-s", CosimError("lost"))
    result = call("sweep", "swept.yaml", "--out", "many", "--json")
    assert result.exit_code == CosimError.exit_code
    answer = json.loads(result.stdout)
    assert (answer["kind"], answer["status"]) == ("sweep", "incomplete")
    assert [point["label"] for point in answer["summary"]["points"]] == ["ideal"]


def test_a_failed_run_answers_in_json_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a script would find nothing to read just when it must."""

    def launch(folder: Path, on_progress: Any) -> Any:
        raise CosimError("grid died")

    monkeypatch.setattr(run_command, "launcher", lambda: launch)
    result = call("run", "tiny.yaml", *SETTINGS, "--out", "out", "--json")
    assert result.exit_code == CosimError.exit_code
    answer = json.loads(result.stdout)
    assert (answer["status"], answer["summary"]) == ("incomplete", None)
    assert "grid died" in answer["reason"]


@pytest.mark.parametrize("config", ["tiny.yaml", "swept.yaml"])
def test_quiet_prints_the_folder_alone(config: str) -> None:
    """Otherwise `folder=$(tieline run ... --quiet)` would not work."""
    settings = SETTINGS if config == "tiny.yaml" else []
    result = call("run", config, *settings, "--out", "out", "--quiet")
    assert (result.exit_code, result.stdout) == (0, "out\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["tiny.yaml", *SETTINGS], "tiny.yaml has no sweep"),
        (["swept.yaml", "--out", "a", "--resume", "b"], "give --out or --resume"),
        ([], "give CONFIG, or --resume DIR"),
        (["--resume", "nowhere"], "nowhere is no result folder"),
    ],
)
def test_what_a_sweep_cannot_begin_with_is_refused(arguments: list[str], words: str) -> None:
    """Otherwise a slip would start another sweep than the one meant."""
    result = call("sweep", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr


def test_a_sweep_for_which_no_core_is_chosen_has_one_process_a_point() -> None:
    """Otherwise a hundred short points would spend half their time on meeting."""

    def core_of(*settings: str) -> str:
        study = start.load_sweep("swept.yaml", list(settings))
        return study.points[0].experiment.federation.core

    assert core_of() == "local"
    assert core_of("federation.core=tcp") == "tcp"


def test_where_points_run_is_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a wrong option would be found after the plan's work, or not at all."""
    planned = run_command.prepared(start.load_sweep("swept.yaml", []))
    assert isinstance(start.runner_of(planned), LocalPool)
    for jobs, scheduler, words in [(0, None, "at least 1"), (2, "tcp://x", "for this machine")]:
        with pytest.raises(start.InputError, match=words):
            start.runner_of(planned, jobs, scheduler)
    monkeypatch.setitem(__import__("sys").modules, "tieline.sweeps.cluster", None)
    with pytest.raises(start.InputError, match=r"pip install 'tieline\[dask\]'"):
        start.runner_of(planned, None, "tcp://x")


def test_of_many_points_the_spread_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a hundred rows and curves would hide what a study found."""
    monkeypatch.setattr(run_command, "MOST_DRAWN", 1)
    result = call("sweep", "swept.yaml", "--out", "out")
    assert result.exit_code == 0, result.output
    rows = {line.split()[0]: line.split()[1:] for line in result.stdout.splitlines() if line}
    # The delays of the two points, 0 and 0.25 s, have their median between them.
    assert rows["delay.mean_s"] == ["0", "ideal", "0.125", "0.25", "0.25", "s"]
    assert "out/points.csv" in result.stdout


def test_the_list_can_be_read_by_a_script() -> None:
    """Otherwise an editor's plug-in would have to parse prose."""
    things = json.loads(call("list", "--json").stdout)
    by_name = {entry["name"]: entry for entry in things["experiments"]}
    assert by_name["g26_trip"]["is_sweep"]
    assert not by_name["g26_trip_smoke"]["is_sweep"]
    assert "miniwecc" in [case["name"] for case in things["cases"]]


def test_the_shell_completes_shipped_names() -> None:
    """Otherwise names would have to be typed in full."""
    assert shipped_names("g26_trip_s") == ["g26_trip_smoke"]


def test_the_help_tells_the_exit_codes() -> None:
    """Otherwise one would have to look for them in the source."""
    text = call("--help").output
    assert "Exit codes: 0 done and whole" in text
    assert "130 interrupted" in text


def test_results_are_compared_and_drawn() -> None:
    """Otherwise the commands would not reach the code behind them."""
    call("run", "swept.yaml", "--out", "out", "--quiet")
    result = call("compare", "out:ideal", "out:0.25 s", "-o", "c.svg", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["runs"] == ["ideal", "0.25 s"]
    result = call("plot", "out:ideal", "coi_pu", "-o", "p.svg", "--from", "1")
    assert (result.exit_code, result.output) == (0, "p.svg\n")
    result = call("plot", "out:ideal", "coi")
    assert result.exit_code == 2
    assert "did you mean 'coi_pu'" in result.stderr


@pytest.mark.parametrize(("level", "code"), [("ok", 0), ("warn", 0), ("fail", 1)])
def test_the_doctor_fails_when_a_check_does(
    monkeypatch: pytest.MonkeyPatch, level: Any, code: int
) -> None:
    """Otherwise an installer's script would go on."""
    finding = Finding("ports", level, "what was found", "what to do")
    monkeypatch.setattr(doctor, "CHECKS", (lambda: finding,))
    result = call("doctor")
    assert result.exit_code == code
    assert result.output == f"{level:<5}ports          what was found\n{'':20}what to do\n"
    result = call("doctor", "--json")
    assert result.exit_code == code
    answer = json.loads(result.output)
    assert answer["is_sound"] is (code == 0)
    assert answer["checks"][0]["advice"] == "what to do"
