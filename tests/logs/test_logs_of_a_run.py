"""What a run of dummies leaves in its logs, and how it is told when the run failed."""

import os
import signal
from pathlib import Path

import pytest

from cosim.dummy import COMMANDS, write_run
from tieline.experiment.launch import FederateFailedError, launch
from tieline.experiment.watch import Progress
from tieline.logs import Record, records

pytestmark = pytest.mark.helics


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Record], str]:
    """Return the log and the message of a run over zmq whose network raises in interval 10."""
    folder = tmp_path_factory.mktemp("failed")
    write_run(folder, "zmq", 100_000, {"network": {"fault": "raise", "fault_at": 10}})
    with pytest.raises(FederateFailedError) as failure:
        launch(folder, commands=COMMANDS)
    return list(records(folder)), str(failure.value)


def test_every_process_has_its_log_and_the_merged_one_tells_the_course(
    failed: tuple[list[Record], str],
) -> None:
    """Otherwise one would have to put the course of a run together by hand."""
    found, _ = failed
    assert {record.process for record in found} == {"launcher", "broker", "grid", "network"}
    told = [record.message for record in found]
    starts = [told.index(f"{name} is started") for name in ("broker", "grid", "network")]
    assert starts == sorted(starts)
    assert told.index("grid is joining") < told.index("grid is running")
    assert found[told.index("grid is joining")].t_ns is None


def test_an_error_is_logged_with_its_traceback_and_the_last_grant(
    failed: tuple[list[Record], str],
) -> None:
    """Otherwise one would know that a federate failed, and neither where nor when."""
    found, message = failed
    own = [r for r in found if r.process == "network" and r.event == "failed"]
    assert len(own) == 1
    assert (own[0].level, own[0].t_ns) == ("error", 166_667_666)
    assert own[0].fields["error"] == "ValueError"
    assert "in advance" in own[0].fields["traceback"]
    # The failure shows its last lines, as people read them.
    assert "  | ValueError: the dummy was told to fail" in message.splitlines()


def test_the_launcher_logs_whose_fault_it_was_and_what_the_others_did(
    failed: tuple[list[Record], str],
) -> None:
    """Otherwise the victims' complaints, which are louder, would be taken for the cause."""
    found, _ = failed
    (fault,) = [r for r in found if r.process == "launcher" and r.level == "error"]
    assert (fault.event, fault.fields["name"]) == ("fault", "network")
    assert set(fault.fields["words"]) == {"broker", "grid", "network"}
    exits = [r.fields for r in found if r.event == "exit"]
    assert {use["name"] for use in exits} == {"broker", "grid", "network"}
    assert all(use["peak_bytes"] > 1_000_000 for use in exits)


def test_warnings_of_a_library_are_records_of_the_process_that_met_them(tmp_path: Path) -> None:
    """Otherwise an overflow in the grid would be printed nowhere, or without its time."""
    options = {"fault": "warn", "fault_at": 3}
    write_run(tmp_path, "local", 6, {"grid": options})
    launch(tmp_path, commands=COMMANDS)
    found = list(records(tmp_path))
    (warning,) = [r for r in found if "the dummy was told to warn" in r.message]
    assert (warning.process, warning.level) == ("together", "warning")
    assert warning.t_ns == 50_002_000
    assert found[-1].message == "every federate reached the end"


def test_the_logs_of_a_run_that_was_interrupted_say_so(tmp_path: Path) -> None:
    """Otherwise an interrupted run would look like a broken one."""
    write_run(tmp_path, "local", 100_000, {"grid": {"pause_s": 0.01}})

    def interrupt(progress: Progress) -> None:
        if progress.k > 0:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        launch(tmp_path, interrupt, commands=COMMANDS)
    own = [r for r in records(tmp_path) if r.process == "launcher" and r.level == "error"]
    assert [r.message for r in own] == ["interrupted"]
