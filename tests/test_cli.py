"""The command line: what it prints, what it writes, and its exit codes."""

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import tieline
from synthetic_result import CONSTANT, EXPERIMENT, SWEEP, fake_launch, known_sites, nothing_drawn
from tieline import cli
from tieline.cli import run as run_command
from tieline.errors import CosimError
from tieline.experiment import artist, plan
from tieline.experiment.results import read_manifest
from tieline.experiment.sweep_run import InTurn

SETTINGS = [part for setting in CONSTANT for part in ("--set", setting)]


@pytest.fixture(autouse=True)
def _no_federation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Stand in for case, network and launcher; each test works in a folder of its own."""
    monkeypatch.setattr(plan.prepare, "__defaults__", (known_sites,))
    monkeypatch.setattr(run_command, "launcher", lambda: fake_launch)
    monkeypatch.setattr(run_command, "steps", lambda core: ((), ()))
    monkeypatch.setattr(run_command, "sweep_runner", lambda *_: InTurn(fake_launch))
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(EXPERIMENT)
    Path("swept.yaml").write_text(EXPERIMENT + SWEEP)


def call(*arguments: str) -> Result:
    """Return what a command line gives."""
    return CliRunner().invoke(cli.app, list(arguments))


@pytest.fixture
def _no_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figures, which take seconds and have tests of their own."""
    monkeypatch.setattr(artist, "_what_draws", lambda: nothing_drawn)


def test_a_run_ends_with_table_and_plots() -> None:
    """Otherwise a newcomer would not see what came out."""
    result = call("run", "tiny.yaml", *SETTINGS, "--out", "out")
    assert result.exit_code == 0, result.output
    for words in ("Does it hold?", "59.766", "0.350", "0.120", "250.0", "out/summary.json"):
        assert words in result.output
    assert "out/plots/overview.png" in result.output
    assert Path("out/plots/overview.png").is_file()
    assert Path("out/table.csv").is_file()
    assert read_manifest(Path("out"))["status"] == "complete"


@pytest.mark.usefixtures("_no_drawing")
def test_a_sweep_has_one_row_a_point() -> None:
    """Otherwise the points could not be compared at a glance."""
    result = call("run", "swept.yaml", "--out", "out")
    assert result.exit_code == 0, result.output
    rows = [line for line in result.output.splitlines() if "59.766" in line]
    assert [row.split("  ")[0].strip() for row in rows] == ["ideal", "0.25 s"]
    assert "[2/2] 0.25 s: complete" in result.output


@pytest.mark.usefixtures("_no_drawing")
def test_a_run_without_out_goes_to_results() -> None:
    """Otherwise a first run would need an option."""
    result = call("run", "tiny.yaml", *SETTINGS)
    assert result.exit_code == 0, result.output
    (folder,) = Path("results").iterdir()
    assert folder.name.startswith("tiny-")


@pytest.mark.usefixtures("_no_drawing")
def test_the_core_is_a_setting() -> None:
    """Otherwise the option would be forgotten by the manifest."""
    result = call("run", "tiny.yaml", *SETTINGS, "--core", "inproc", "--out", "out")
    assert result.exit_code == 0, result.output
    assert read_manifest(Path("out"))["config"]["federation"]["core"] == "inproc"


def test_run_without_a_name_explains_and_lists() -> None:
    """Otherwise a newcomer would meet a usage line only."""
    result = call("run")
    assert result.exit_code == 2
    assert "my_experiment.yaml" in result.output
    assert "g26_trip_beta2" in result.output


def test_list_shows_each_experiment_with_its_question() -> None:
    """Otherwise one would have to open the files to choose."""
    result = call("list")
    assert result.exit_code == 0
    assert "g26_trip_smoke" in result.output
    assert "after the loss of unit G26" in result.output
    assert "miniwecc" in result.output


def test_validate_starts_and_writes_nothing(tmp_path: Path) -> None:
    """Otherwise a check would cost as much as a run."""
    before = sorted(tmp_path.iterdir())
    result = call("validate", "swept.yaml")
    assert result.exit_code == 0
    assert result.output == "tiny is valid: 2 to run (ideal, 0.25 s)\n"
    assert sorted(tmp_path.iterdir()) == before


def test_report_draws_a_result_again() -> None:
    """Otherwise a changed figure would need a new run."""
    call("run", "tiny.yaml", *SETTINGS, "--out", "out")
    Path("out/plots/overview.png").unlink()
    result = call("report", "out")
    assert result.exit_code == 0, result.output
    assert Path("out/plots/overview.png").is_file()
    assert call("report", "nowhere").exit_code == 2


def test_the_version_is_told() -> None:
    """Otherwise a fault report could not name it."""
    assert call("--version").output == f"tieline {tieline.__version__}\n"


@pytest.mark.parametrize("command", ["run", "validate"])
def test_bad_input_is_a_message_and_exit_code_2(command: str) -> None:
    """Otherwise a typing mistake would print a traceback, or a script would go on."""
    result = call(command, "tiny.yaml", "--set", "grid.duraton=3")
    assert result.exit_code == 2
    assert result.stderr.startswith("--set grid.duraton=3: unknown key 'duraton'")
    assert "Traceback" not in result.output
    assert not Path("results").exists()


def test_markup_in_a_message_is_left_as_it_is() -> None:
    """Otherwise `events[0]` would lose its place in the list."""
    result = call("validate", "tiny.yaml", *SETTINGS, "--set", "grid.events.0.at=soon")
    assert "grid.events[0].at must be a time" in result.stderr


def test_debug_adds_the_traceback() -> None:
    """Otherwise a developer could not find where a refusal arose."""
    result = call("validate", "tiny.yaml", "--set", "sed=3", "--debug")
    assert result.exit_code == 2
    assert "Traceback" in result.stderr
    assert "unknown key 'sed'" in result.stderr


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (CosimError("grid died"), 4, "grid died"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ValueError("odd"), 1, "unexpected ValueError: odd; --debug shows where"),
    ],
)
def test_a_failed_run_exits_with_the_code_of_its_error(
    monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int, words: str
) -> None:
    """Otherwise a script would take a failed run for a good one."""

    def launch(folder: Path, on_progress: Any) -> Any:
        raise error

    monkeypatch.setattr(run_command, "launcher", lambda: launch)
    result = call("run", "tiny.yaml", *SETTINGS, "--out", "out")
    assert result.exit_code == code
    assert words in result.stderr
    assert "Traceback" not in result.output
    assert read_manifest(Path("out"))["status"] == "incomplete"


def test_a_folder_with_other_files_is_refused_before_anything_starts() -> None:
    """Otherwise a run would end in a refusal after its work was done."""
    Path("notes").mkdir()
    Path("notes/mine.txt").write_text("")
    result = call("run", "tiny.yaml", *SETTINGS, "--out", "notes")
    assert result.exit_code == 2
    assert "no result of tieline" in result.stderr


def test_no_command_shows_the_help() -> None:
    """Otherwise `tieline` alone would do nothing."""
    result = call()
    assert "tieline list" in result.output
