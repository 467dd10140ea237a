"""Federations of dummies with a guest that nobody checked."""

import json
import sys
from pathlib import Path

import pytest

from cosim.dummy import COMMANDS, write_run
from tieline.experiment.launch import FederateFailedError, launch

pytestmark = pytest.mark.helics

LONG = 3_000
GUEST = """
import helics, json, sys, time
config = json.load(open(sys.argv[1]))
federate = helics.helicsCreateMessageFederateFromConfig(sys.argv[1])
# Time waits for whoever may send a message; without an endpoint it would not wait for this one.
helics.helicsFederateRegisterGlobalEndpoint(federate, "visitor/any")
helics.helicsFederateEnterExecutingMode(federate)
for k in range(config["tieline"]["intervals"]):
    helics.helicsFederateRequestTime(federate, k / 60 + 3e-6)
    if k == 5 and sys.argv[2] == "hangs":
        time.sleep(3600)
    if k == 5 and sys.argv[2] == "dies":
        raise SystemExit("the guest was told to die")
helics.helicsFederateDisconnect(federate)
"""


def write_guest_run(folder: Path, manner: str, intervals: int, **timeouts: float) -> None:
    write_run(folder, "zmq", intervals, {}, **timeouts)
    (folder / "guest.py").write_text(GUEST)
    run = json.loads((folder / "run.json").read_text())
    command = f"{sys.executable} guest.py {{config}} {manner}"
    run["federation"]["guests"] = [{"name": "visitor", "command": command}]
    run["guest_directory"] = str(folder)
    (folder / "run.json").write_text(json.dumps(run))


def test_a_guest_takes_part_and_changes_nothing(tmp_path: Path) -> None:
    """Who only looks on must not move a bit."""
    write_guest_run(tmp_path / "with", "looks", 20)
    write_run(tmp_path / "alone", "local", 20, {})
    for name in ("with", "alone"):
        outcome = launch(tmp_path / name, commands=COMMANDS)
        if name == "with":
            assert {use.name: use.exit_code for use in outcome.processes}["visitor"] == 0
    for side in ("grid", "network"):
        digests = [(tmp_path / name / f"{side}.digest").read_text() for name in ("with", "alone")]
        assert digests[0] == digests[1]


def test_a_guest_that_dies_ends_the_run_with_its_name_and_its_words(tmp_path: Path) -> None:
    """If not, the federation would wait for it, or go on without its control."""
    write_guest_run(tmp_path, "dies", LONG)
    with pytest.raises(FederateFailedError, match=r"visitor: died: exit code 1") as failure:
        launch(tmp_path, commands=COMMANDS)
    assert "the guest was told to die" in str(failure.value)
    assert (tmp_path / "grid.aborted").exists()
    assert (tmp_path / "network.aborted").exists()


def test_a_guest_that_hangs_is_named(tmp_path: Path) -> None:
    """If not, grid or network would be blamed for waiting."""
    write_guest_run(tmp_path, "hangs", LONG, hang_timeout=1.5)
    with pytest.raises(FederateFailedError, match=r"visitor: hung: .* and the others wait"):
        launch(tmp_path, commands=COMMANDS)


def test_a_guest_that_never_joins_is_named(tmp_path: Path) -> None:
    """If not, a slip in a command line would look like a fault of tieline."""
    write_run(tmp_path, "zmq", LONG, {}, hang_timeout=1.5)
    run = json.loads((tmp_path / "run.json").read_text())
    run["federation"]["guests"] = [{"name": "absent", "command": "sleep 60"}]
    run["guest_directory"] = str(tmp_path)
    (tmp_path / "run.json").write_text(json.dumps(run))
    with pytest.raises(FederateFailedError, match="absent: hung: it has not joined"):
        launch(tmp_path, commands=COMMANDS)
