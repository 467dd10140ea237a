"""What `tieline doctor --last` tells of runs that failed, were killed, or are whole."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from synthetic_result import fake_launch, outcome, plan_of
from tieline.cli import app
from tieline.cosim.interfaces import NETWORK, FederationSettings
from tieline.doctor.causes import CAUSES, cause_of
from tieline.doctor.last import last_result, story_of
from tieline.errors import InputError
from tieline.experiment.launch import FederateFailedError, Outcome
from tieline.experiment.point import UNDER_WAY
from tieline.experiment.run import RunFailedError, execute
from tieline.experiment.run_logs import RunLogs
from tieline.experiment.supervise import ProcessUse
from tieline.experiment.watch import Progress, Suspect, Watch
from tieline.tables import Column, TableStream

OnProgress = Callable[[Progress], None]


def killing_launch(folder: Path, on_progress: OnProgress) -> Outcome:
    """Write half a run, then fail as one does whose network was killed."""
    stream = TableStream(folder / "grid.parquet", [Column("t_s", "s", "time")])
    stream.append({"t_s": np.array([0.0, 0.5])})
    stream.flush()
    suspect = Suspect(NETWORK, "died: killed by SIGKILL (last granted 0.400001 s)", 4)
    logs = RunLogs(folder, Watch(FederationSettings()), "launcher")
    log = logs.of(NETWORK)
    log.take(b"its last words", is_error=True)
    log.close()
    word = {"federate": "grid", "state": "running", "k": 30, "granted_ns": 500_002_000}
    logs.hear({**word, "waits": True})
    logs.fault(suspect)
    logs.used(ProcessUse(NETWORK, -9, 1.0, 100))
    logs.close()
    raise FederateFailedError(suspect, outcome(0.5), list(log.tail))


@pytest.fixture
def failed(tmp_path: Path) -> Path:
    """Return the result folder of a run whose network was killed."""
    target = tmp_path / "results" / "trip"
    with pytest.raises(RunFailedError):
        execute(plan_of(tmp_path), target, killing_launch)
    return target


def test_a_failed_run_is_explained(failed: Path) -> None:
    """Otherwise a user would have to know the launcher to find out who was at fault."""
    story = story_of(failed)
    assert (story.status, story.culprit) == ("incomplete", "network")
    assert "SIGKILL" in story.reason
    assert story.reached_s == pytest.approx(0.500002)
    assert story.others == {"grid": "running, last granted 0.500002 s, waiting for a grant"}
    assert list(story.lines) == ["its last words"]
    assert story.cause is not None
    assert story.cause.name == "killed"
    assert story.tables == {"grid.parquet": 0.5}


def test_the_command_tells_it_in_words_and_as_json(
    failed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise it would help only those who read code."""
    monkeypatch.chdir(failed.parent.parent)
    told = CliRunner().invoke(app, ["doctor", "--last"])
    assert told.exit_code == 0, told.output
    for text in ("died: killed by SIGKILL", "of 41 s of simulated time", "its last words",
                 "out-of-memory killer", "dmesg", "grid.parquet (to 0.5 s)"):  # fmt: skip
        assert text in told.output
    data = json.loads(CliRunner().invoke(app, ["doctor", "--last", "--json"]).output)
    assert (data["culprit"], data["cause"]["name"]) == ("network", "killed")
    assert CliRunner().invoke(app, ["doctor", str(failed)]).exit_code == InputError.exit_code


def test_the_log_command_shows_some_of_the_merged_log(failed: Path) -> None:
    """Otherwise a reader would have to merge JSON lines by hand."""
    whole = CliRunner().invoke(app, ["log", str(failed)])
    assert whole.exit_code == 0, whole.output
    assert "its last words" in whole.output
    assert "network: died" in whole.output
    one = CliRunner().invoke(app, ["log", str(failed), "--process", "network"])
    assert one.output.splitlines()[0].split()[-3:] == ["its", "last", "words"]
    wrong = CliRunner().invoke(app, ["log", str(failed), "--process", "netwrok"])
    assert wrong.exit_code == InputError.exit_code
    assert CliRunner().invoke(app, ["log", str(failed), "--level", "bad"]).exit_code == 2


def test_a_whole_run_is_said_to_be_whole(tmp_path: Path) -> None:
    """Otherwise the doctor would find an illness in everybody."""
    folder = execute(plan_of(tmp_path), tmp_path / "out", fake_launch)
    story = story_of(folder)
    assert (story.status, story.cause) == ("complete", None)
    assert story.tables["grid.parquet"] == pytest.approx(41.0)


@pytest.fixture
def left_behind(failed: Path) -> Callable[[int], Path]:
    """Return what makes a folder as a launcher of some process number leaves it when killed."""

    def leave(pid: int) -> Path:
        folder = failed.with_name(f".trip.partial-{pid}")
        shutil.copytree(failed, folder)
        shutil.rmtree(folder / "logs")
        (folder / "grid.parquet").unlink()
        stream = TableStream(folder / "grid.parquet", [Column("t_s", "s", "time")])
        stream.append({"t_s": np.array([0.0, 0.25])})
        stream.flush()
        path = folder / "manifest.json"
        manifest = json.loads(path.read_text()) | {"reason": UNDER_WAY}
        path.write_text(json.dumps(manifest))
        return folder

    return leave


def test_a_killed_launcher_is_told_and_its_stream_made_readable(
    left_behind: Callable[[int], Path],
) -> None:
    """Otherwise the run that vanished without a word would be the one without an explanation."""
    # Beyond the largest process number that Linux gives.
    folder = left_behind(2**22 + 1)
    assert last_result(folder.parent.parent) == folder
    story = story_of(folder)
    assert story.cause is not None
    assert story.cause.name == "launcher killed"
    assert story.made == ["grid.parquet"]
    assert story.tables == {"grid.parquet": 0.25}


def test_a_run_under_way_is_left_alone(left_behind: Callable[[int], Path]) -> None:
    """Otherwise looking at a run would take its tables away from it."""
    folder = left_behind(os.getpid())
    assert story_of(folder).status == "under way"
    assert (folder / "grid.arrows").is_file()


def test_a_folder_without_results_is_refused_in_words(tmp_path: Path) -> None:
    """Otherwise the doctor would end in a traceback of its own."""
    with pytest.raises(InputError, match=r"no result in .*: give the folder"):
        last_result(tmp_path)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("grid: hung: no federate was granted anything for 60 s of wall time", "hang"),
        ("grid: hung: it has not joined the federation for 600 s of wall time", "never joined"),
        ("grid: hung: its process is stopped by a signal", "stopped"),
        ("network: OSError: [Errno 28] No space left on device", "full disk"),
        ("broker: died: exit code 1", "broker lost"),
        ("broker: died: killed by SIGKILL", "killed"),
        ("None: interrupted from the keyboard", "interrupted"),
        ("grid: terminated by SIGTERM", "terminated"),
        ("grid: died: killed by SIGSEGV", "crash"),
        ("network: could not be started: [Errno 2]", "not started"),
        ("grid: the voltage of bus 4 is not finite at 1.2 s", "numerical"),
        ("network: grid's bundle 4 came stamped 3 ns, the contract says 4", "time contract"),
        ("grid: KeyError: 'x'", "own error"),
    ],
)
def test_each_kind_of_failure_has_its_own_explanation(text: str, name: str) -> None:
    """Otherwise a user with a full disk would be sent to look for a hang."""
    assert cause_of(text).name == name


def test_every_explanation_says_what_to_do() -> None:
    """Otherwise it would be a diagnosis without a treatment."""
    assert all(cause.usual.endswith(".") and cause.advice.endswith(".") for cause in CAUSES)
