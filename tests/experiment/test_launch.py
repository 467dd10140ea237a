"""Whole federations of dummies: alike over every core, and ended at the first fault.

What is done to their processes from outside stands in `tests/faults`.
"""

import json
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from cosim.dummy import COMMANDS, write_run
from tieline.experiment.launch import FederateFailedError, Outcome, launch
from tieline.experiment.watch import Progress

pytestmark = pytest.mark.helics

SLOW = {"grid": {"pause_s": 0.02}, "network": {"pause_s": 0.02, "pause_seed": 1}}
ENDLESS = 100_000
PATIENCE_S = 60.0


def run_pair(
    folder: Path,
    core: str,
    dummies: dict[str, Any],
    intervals: int = 20,
    lead: int = 0,
    **launch_options: Any,
) -> tuple[str, str]:
    """Return the digests of what grid and network received in a whole run."""
    write_run(folder, core, intervals, dummies, lead)
    launch(folder, commands=COMMANDS, **launch_options)
    grid, network = ((folder / f"{name}.digest").read_text() for name in ("grid", "network"))
    return grid, network


def processes_of(folder: Path) -> list[str]:
    """Return the command lines of the living processes that work on a run folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if str(folder / "run.json").encode() in words:
            found.append(b" ".join(words).decode())
    return found


def fail_run(folder: Path) -> tuple[FederateFailedError, float]:
    """Return the failure of a run that must fail, and how long the launch took, s."""
    began_s = time.monotonic()
    with pytest.raises(FederateFailedError) as failure:
        launch(folder, commands=COMMANDS)
    assert processes_of(folder) == []
    assert failure.value.exit_code != 0
    return failure.value, time.monotonic() - began_s


@pytest.mark.parametrize("lead", [0, 5])
def test_every_core_start_order_and_pause_gives_the_same_bytes(lead: int, tmp_path: Path) -> None:
    """If not, a result would depend on how the federates happened to meet."""
    alike = run_pair(tmp_path / "local", "local", {}, lead=lead)
    assert run_pair(tmp_path / "inproc", "inproc", SLOW, lead=lead) == alike
    assert run_pair(tmp_path / "zmq", "zmq", {}, lead=lead) == alike
    late = run_pair(
        tmp_path / "late", "zmq", SLOW, lead=lead, order=("network", "grid"), stagger_s=0.4
    )
    assert late == alike
    # 9 kB bundles are three messages each on tcp, where HELICS loses those above 4,000 bytes.
    assert run_pair(tmp_path / "tcp", "tcp", {}, lead=lead) == alike
    assert run_pair(tmp_path / "longer", "local", {}, intervals=24, lead=lead) != alike


def test_a_local_run_needs_no_helics(tmp_path: Path) -> None:
    """If not, the one-process runner would be no check on HELICS."""
    run_pair(tmp_path / "local", "local", {}, intervals=2)
    assert (tmp_path / "local" / "helics").read_text() == "False"
    run_pair(tmp_path / "inproc", "inproc", {}, intervals=2)
    assert (tmp_path / "inproc" / "helics").read_text() == "True"


def test_two_runs_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    """If not, a user with two terminals would get wrong or failed runs."""
    digests: dict[str, tuple[str, str]] = {}

    def run(name: str) -> None:
        digests[name] = run_pair(tmp_path / name, "zmq", SLOW)

    threads = [threading.Thread(target=run, args=(name,)) for name in ("a", "b")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert digests["a"] == digests["b"]
    ports = {
        json.loads((tmp_path / name / "run.json").read_text())["federation"]["broker_port"]
        for name in ("a", "b")
    }
    assert len(ports) == 2


def test_the_outcome_tells_times_last_grants_and_cost(tmp_path: Path) -> None:
    """If not, the manifest could not say how far each federate came and what it took."""
    write_run(tmp_path, "zmq", 6, {})
    words: list[Progress] = []
    outcome: Outcome = launch(tmp_path, words.append, commands=COMMANDS)
    assert outcome.granted_ns == {"grid": 100_002_000, "network": 100_001_000}
    assert set(outcome.wall_s) == {"start", "run", "end"}
    assert {use.name: use.exit_code for use in outcome.processes} == {
        "broker": 0,
        "grid": 0,
        "network": 0,
    }
    assert all(use.peak_bytes > 1_000_000 for use in outcome.processes)
    assert {word.state for word in words if word.federate == "grid"} >= {"opening", "finished"}
    assert processes_of(tmp_path) == []


@pytest.mark.parametrize("core", ["zmq", "inproc", "local"])
def test_a_participant_that_raises_is_named_and_both_are_saved(tmp_path: Path, core: str) -> None:
    """If not, a numerical failure would look like a communication failure, or be lost."""
    write_run(tmp_path, core, ENDLESS, {"network": {"fault": "raise", "fault_at": 10}})
    failure, took_s = fail_run(tmp_path)
    assert failure.federate == "network"
    assert "ValueError: the dummy was told to fail" in str(failure)
    assert failure.outcome.granted_ns["network"] == 166_667_666
    assert (tmp_path / "grid.aborted").exists()
    assert (tmp_path / "network.aborted").exists()
    assert took_s < PATIENCE_S


@pytest.mark.parametrize("core", ["zmq", "inproc"])
def test_a_participant_that_does_not_open_is_named(tmp_path: Path, core: str) -> None:
    """If not, the other one would wait for it for ever."""
    write_run(tmp_path, core, ENDLESS, {"grid": {"fault": "refuse"}})
    failure, took_s = fail_run(tmp_path)
    assert failure.federate == "grid"
    assert "told not to open" in str(failure)
    assert took_s < PATIENCE_S


def test_an_end_marker_that_does_not_fit_fails_the_run(tmp_path: Path) -> None:
    """If not, a run that lost messages would be complete."""
    write_run(tmp_path, "zmq", 5, {"grid": {"fault": "lie"}})
    failure, _ = fail_run(tmp_path)
    assert failure.federate == "network"
    assert "grid sent 0 messages, 0 bytes" in str(failure)


def test_a_federate_that_exits_by_itself_is_named_with_its_code(tmp_path: Path) -> None:
    """If not, a crash inside a library would be nobody's."""
    write_run(tmp_path, "zmq", ENDLESS, {"grid": {"fault": "exit", "fault_at": 3}})
    failure, took_s = fail_run(tmp_path)
    assert failure.federate == "grid"
    assert "exit code 7" in str(failure)
    assert took_s < PATIENCE_S


def test_a_federate_that_hangs_is_named(tmp_path: Path) -> None:
    """If not, an endless loop in one federate would take the machine for the night."""
    write_run(
        tmp_path, "zmq", ENDLESS, {"network": {"fault": "hang", "fault_at": 9}}, hang_timeout=1.5
    )
    failure, took_s = fail_run(tmp_path)
    assert failure.federate == "network"
    assert "hung" in str(failure)
    assert took_s < PATIENCE_S


def test_a_federate_that_never_starts_is_named(tmp_path: Path) -> None:
    """If not, the others would wait for it as long as the start may take at most."""
    write_run(tmp_path, "zmq", 3, {"network": {"open_s": 3600}}, hang_timeout=1.5)
    failure, took_s = fail_run(tmp_path)
    assert failure.federate == "network"
    assert "has not joined the federation" in str(failure)
    assert "no process worked" in str(failure)
    assert took_s < PATIENCE_S


def test_slow_opening_is_no_hang(tmp_path: Path) -> None:
    """If not, the first run on a machine, which compiles, would fail."""
    write_run(tmp_path, "zmq", 3, {"grid": {"open_s": 1.5}}, hang_timeout=5.0)
    launch(tmp_path, commands=COMMANDS)
    assert (tmp_path / "grid.digest").exists()


def test_a_command_that_does_not_exist_is_named(tmp_path: Path) -> None:
    """If not, a broken installation would end in a traceback and a living broker."""
    write_run(tmp_path, "zmq", 3, {})
    with pytest.raises(FederateFailedError, match="network: could not be started"):
        launch(tmp_path, commands={**COMMANDS, "network": ("/nonexistent/python",)})
    assert processes_of(tmp_path) == []


def test_the_memory_of_a_process_is_its_own_and_not_its_launchers(tmp_path: Path) -> None:
    """If not, the manifest would put the launcher's memory down to the broker."""
    ballast = b"x" * 150_000_000
    write_run(tmp_path, "local", 20, {"grid": {"pause_s": 0.05}})
    (use,) = launch(tmp_path, commands=COMMANDS).processes
    assert 5_000_000 < use.peak_bytes < len(ballast)
