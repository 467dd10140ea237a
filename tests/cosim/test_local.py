"""The run in one process: the order of the turns, and what happens when one fails."""

import json
from pathlib import Path

import pytest

from cosim.dummy import Dummy
from tieline.cosim.guard import GuardedParticipant
from tieline.cosim.interfaces import Clock
from tieline.cosim.local import run_local
from tieline.cosim.status import Heartbeat, Status
from tieline.errors import CosimError


def pair(folder: Path, **grid_options: object) -> tuple[Dummy, Dummy]:
    """Return a grid and a network dummy."""
    return Dummy("grid", folder, dict(grid_options)), Dummy("network", folder, {})


def test_the_network_has_the_first_turn_of_each_interval(tmp_path: Path) -> None:
    """If not, the one-process run would differ from the federation."""
    turns: list[tuple[str, int, int]] = []
    run_local(*pair(tmp_path), Clock(60, 1), lambda *turn: turns.append(turn))
    assert turns == [
        ("network", 0, 1_000),
        ("grid", 0, 2_000),
        ("network", 1, 16_667_666),
        ("grid", 1, 16_668_666),
    ]


def test_two_runs_are_alike_and_a_longer_one_is_not(tmp_path: Path) -> None:
    """If not, the digests that the federation is compared by would prove nothing."""
    digests = []
    for intervals in (5, 5, 6):
        run_local(*pair(tmp_path), Clock(60, intervals))
        digests.append((tmp_path / "grid.digest").read_text())
    assert digests[0] == digests[1] != digests[2]


def test_a_failure_of_one_aborts_both_and_is_passed_on(tmp_path: Path) -> None:
    """If not, the other one's results would be lost with the run."""
    grid, network = pair(tmp_path, fault="raise", fault_at=2)
    with pytest.raises(ValueError, match="told to fail"):
        run_local(grid, network, Clock(60, 5))
    assert (tmp_path / "grid.aborted").read_text() == "the dummy was told to fail"
    assert (tmp_path / "network.aborted").exists()
    assert not (tmp_path / "network.digest").exists()


def test_a_stopped_participant_takes_no_further_turn_and_is_saved_once(tmp_path: Path) -> None:
    """If not, a terminated run would go on, or overwrite what it had saved."""
    guarded = GuardedParticipant(pair(tmp_path)[0])
    guarded.start()
    guarded.stop("terminated by SIGTERM")
    with pytest.raises(CosimError, match="terminated by SIGTERM"):
        guarded.advance(0, b"")
    guarded.abort("first")
    guarded.abort("second")
    assert (tmp_path / "grid.aborted").read_text() == "first"


def test_a_finished_participant_is_not_aborted(tmp_path: Path) -> None:
    """If not, whole results would be marked as cut off."""
    guarded = GuardedParticipant(pair(tmp_path)[0])
    guarded.finish()
    guarded.abort("too late")
    assert not (tmp_path / "grid.aborted").exists()


def test_a_participant_that_cannot_even_abort_leaves_the_first_failure_in_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """If not, the report would name the clean-up instead of the fault."""
    gone = tmp_path / "gone"
    GuardedParticipant(Dummy("grid", gone, {})).abort("a reason")
    assert "FileNotFoundError" in capsys.readouterr().err


def test_a_status_says_what_a_launcher_needs_and_only_the_first_failure(tmp_path: Path) -> None:
    """If not, the launcher could neither show progress nor name the culprit."""
    path = tmp_path / "lines"
    with path.open("wb") as file:
        status = Status("grid", file.fileno())
        with Heartbeat([status]):
            status.enter("running")
            status.wait()
            status.grant(3, 50_000_000)
            status.fail("it broke", "own", 3)
            status.fail("it broke again", "other", 4)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    # The first grant is told at once, later ones by the heartbeat.
    assert [line["state"] for line in lines] == ["running", "running", "failed"]
    assert [line["granted_ns"] for line in lines] == [-1, 50_000_000, 50_000_000]
    del lines[2]["cpu_s"]
    assert lines[2] == {
        "federate": "grid",
        "state": "failed",
        "k": 3,
        "granted_ns": 50_000_000,
        "waits": False,
        "reason": "it broke",
        "fault": "own",
        "exit_code": 3,
    }
