"""Runs at once on one computer: they never meet, in ports, names, folders or keys.

broker <-> grid, network      four such federations of dummies at once, over zmq and tcp; more with
                              TIELINE_RUNS_AT_ONCE=8
tieline run --out X           twice at once
"""

import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import pytest

from cosim.dummy import COMMANDS, write_run
from synthetic_result import EXPERIMENT, SWEEP, fake_launch, plan_of
from tieline.errors import InputError
from tieline.experiment.keys import HELICS_VARIABLE
from tieline.experiment.launch import launch
from tieline.experiment.results import read_runs
from tieline.experiment.run import execute

AT_ONCE = int(os.environ.get("TIELINE_RUNS_AT_ONCE", "4"))
STRANGER = """
import sys
import helics
options = f"--federates=1 --brokerport={sys.argv[2]} --networktimeout=2s"
config = '{"name": "stranger", "core_type": "%s", "core_init_string": "%s"}'
try:
    helics.helicsCreateMessageFederateFromConfig(config % (sys.argv[1], options))
except helics.HelicsException as error:
    sys.exit(f"refused: {error}")
"""


def run_dummies(folder: Path, core: str, number: int, gate: threading.Barrier) -> tuple[int, str]:
    """Return the port of a run and a digest of all that its federates received."""
    folder.mkdir()
    dummies = {name: {"pause_s": 0.01, "pause_seed": number} for name in ("grid", "network")}
    write_run(folder, core, 20, dummies)
    gate.wait()
    launch(folder, commands=COMMANDS)
    told = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    digests = [(folder / f"{name}.digest").read_text() for name in ("grid", "network")]
    return told["federation"]["broker_port"], " ".join(digests)


@pytest.mark.helics
def test_runs_at_once_never_meet(tmp_path: Path) -> None:
    """If two met, a federate would take another run's frames for its own."""
    gate = threading.Barrier(AT_ONCE)

    def one(number: int) -> tuple[int, str]:
        core = "zmq" if number % 2 else "tcp"
        return run_dummies(tmp_path / f"run{number}", core, number, gate)

    with ThreadPoolExecutor(AT_ONCE) as pool:
        ended = list(pool.map(one, range(AT_ONCE)))
    ports = sorted(port for port, _ in ended)
    # A block of a hundred ports each.
    assert all(later - earlier >= 100 for earlier, later in pairwise(ports))
    assert len({digest for _, digest in ended}) == 1


@pytest.mark.helics
@pytest.mark.parametrize("core", ["zmq", "tcp"])
def test_a_federate_without_the_key_of_a_run_is_refused(core: str, tmp_path: Path) -> None:
    """If not, whoever finds the port of a run on this computer could take part in it."""
    said: list[str] = []

    def knock() -> None:
        told = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))
        port = str(told["federation"]["broker_port"])
        environment = {key: value for key, value in os.environ.items() if key != HELICS_VARIABLE}
        words = [sys.executable, "-c", STRANGER, core, port]
        done = subprocess.run(
            words, capture_output=True, text=True, env=environment, timeout=60, check=False
        )
        said.append(done.stderr)

    # Before the federates join: HELICS ends a federation under way that somebody tries to join.
    slow = {"open_s": 4.0}
    write_run(tmp_path, core, 20, {"grid": slow, "network": slow})
    launch(tmp_path, lambda _: None if said else knock(), commands=COMMANDS)
    assert "refused: " in said[0]
    assert "broker key does not match" in said[0] or "Unable to connect" in said[0]


def test_a_second_run_to_the_same_folder_is_refused_while_the_first_goes_on(tmp_path: Path) -> None:
    """If not, the later of two runs would silently replace the result of the other."""
    plan, target = plan_of(tmp_path), tmp_path / "results" / "r"
    refused: list[str] = []

    def launch_and_run_again(folder: Path, *how: object) -> object:
        with pytest.raises(InputError, match="another run is under way") as caught:
            execute(plan, target, fake_launch)
        refused.append(str(caught.value))
        return fake_launch(folder, *how)  # type: ignore[arg-type]

    execute(plan, target, launch_and_run_again)  # type: ignore[arg-type]
    assert len(refused) == 1
    assert read_runs(target)[0].is_complete
    assert [path.name for path in target.parent.iterdir()] == ["r"]
    execute(plan, target, fake_launch)


def test_a_second_sweep_to_the_same_folder_is_refused_while_the_first_goes_on(
    tmp_path: Path,
) -> None:
    """If not, going on with a sweep from two windows would leave points of both, mixed."""
    plan, target = plan_of(tmp_path, f"{EXPERIMENT}{SWEEP}"), tmp_path / "sweep"

    def launch_and_run_again(folder: Path, *how: object) -> object:
        with pytest.raises(InputError, match="another sweep is at work"):
            execute(plan, target, fake_launch)
        return fake_launch(folder, *how)  # type: ignore[arg-type]

    execute(plan, target, launch_and_run_again)  # type: ignore[arg-type]
    runs = read_runs(target)
    assert len(runs) == 2
    assert all(run.is_complete for run in runs)
