"""A fixed dozen of harms, done to real processes with dummies for grid and network.

`python tests/faults/trials.py` does the same to whole simulations, as many as are asked for.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from faults.harness import harm
from faults.trial import VISITOR, Trial
from synthetic_result import fake_launch, plan_of
from tieline.experiment.run import execute

pytestmark = pytest.mark.helics

PATIENCE_S = 60.0
PROGRAM = Path(__file__).with_name("program.py")
RUNNING = [
    Trial("KILL", "launcher", "running", "zmq", 0.3, has_older=True),
    Trial("INT", "launcher", "running", "local", 0.1),
    Trial("INT INT", "launcher", "running", "local", 0.2),
    Trial("TERM", "launcher", "running", "local", 0.1, has_older=True),
    Trial("KILL", "broker", "running", "tcp", 0.1),
    Trial("STOP", "broker", "running", "zmq", 0.2),
    Trial("KILL", "grid", "running", "zmq", 0.4),
    Trial("STOP", "together", "running", "local", 0.1),
    Trial("TERM", "together", "running", "inproc", 0.1),
    Trial("KILL", "together", "start", "local", 0.3),
    Trial("FILE LIMIT", "together", "running", "local", 0.1),
    Trial("KILL", VISITOR, "running", "zmq", 0.2),
]


def command(trial: Trial) -> list[str]:
    """Return what starts the stand-in of a trial; the visitor is there when it may be left over."""
    has_guest = trial.victim == VISITOR or (trial.has_older and trial.core == "zmq")
    return [sys.executable, str(PROGRAM), trial.core, *(["GUEST"] if has_guest else [])]


@pytest.fixture(scope="module")
def older(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a whole result of an earlier time."""
    folder = tmp_path_factory.mktemp("older")
    out = execute(plan_of(folder), folder / "out", fake_launch)
    manifest = json.loads((out / "manifest.json").read_text())
    (out / "manifest.json").write_text(json.dumps(manifest | {"label": "older"}))
    return out


@pytest.mark.parametrize("trial", RUNNING, ids=lambda trial: f"{trial.kind} {trial.core}")
def test_a_harmed_run_ends_in_time_and_leaves_nothing_but_its_result(
    trial: Trial, tmp_path: Path, older: Path
) -> None:
    """If not, a federation would hang, lie about its end, or leave processes, ports and files."""
    if trial.has_older:
        shutil.copytree(older, tmp_path / "out")
    finding = harm(trial, command(trial), tmp_path, PATIENCE_S)
    assert finding.broken == []
    assert finding.status == "incomplete"


DISK = """
import sys; sys.path.insert(0, sys.argv[1])
from pathlib import Path; from faults.harness import harm; from faults.trial import Trial
trial = Trial("FULL DISK", "disk", "running", "local", 0.1)
finding = harm(trial, [sys.executable, *sys.argv[3:]], Path(sys.argv[2]), 60.0)
print(finding.reason); sys.exit(str(finding.broken) if finding.broken else 0)
"""
MOUNTED = 'mount -t tmpfs -o size=2m none "$1" && shift && exec "$@"'


@pytest.mark.skipif(
    subprocess.run(["unshare", "--mount", "true"], check=False, capture_output=True).returncode
    if shutil.which("unshare")
    else 1,
    reason="only who may mount a small disk in a name space of their own can fill one",
)
def test_a_full_disk_ends_the_run_and_what_was_written_is_readable(tmp_path: Path) -> None:
    """If not, a night's run would hang, or end as if it were whole, when the disk is full."""
    inner = [sys.executable, "-c", DISK, str(PROGRAM.parent.parent), str(tmp_path)]
    done = subprocess.run(
        ["unshare", "--mount", "sh", "-c", MOUNTED, "sh", tmp_path, *inner, PROGRAM, "local"],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "No space left on device" in done.stdout
