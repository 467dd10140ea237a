"""Makes runs in a process that stays, one after the other, both federates in it without HELICS.

A process of its own for each run would spend more time on its start than on a short run. What it is
to make comes as JSON lines on its standard input, and an answer a line goes back:

    {"experiment": ..., "settings": [...], "target": ...}  ->  {"folder": ...}
                                                           ->  {"error": ..., "exit_code": ...}
"""

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tieline.cosim.guard import GuardedParticipant
from tieline.cosim.interfaces import GRID, NETWORK, Clock
from tieline.cosim.local import run_local
from tieline.cosim.process import die_with_launcher, exit_code_of, reason_of
from tieline.experiment.launch import Outcome
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.experiment.results import read_json
from tieline.experiment.run import execute
from tieline.experiment.watch import Progress
from tieline.grid.federate import open_participant as open_grid
from tieline.network.federate import open_participant as open_network

CORE = "federation.core=local"


def main() -> None:
    """Answer every line of the standard input until it ends."""
    die_with_launcher()
    # Whatever else is printed must not be taken for an answer.
    answers, sys.stdout = os.fdopen(os.dup(1), "w"), sys.stderr
    for line in sys.stdin:
        wanted = json.loads(line)
        try:
            folder = made(wanted["experiment"], wanted["settings"], Path(wanted["target"]))
            answer: dict[str, str | int] = {"folder": str(folder)}
        except Exception as error:
            answer = {"error": reason_of(error), "exit_code": exit_code_of(error)}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def made(experiment: str, settings: list[str], target: Path) -> Path:
    """Return the result folder of a run, made here.

    Raises:
        InputError: the experiment cannot be.
        RunFailedError: a federate failed.
    """
    plan = prepare(load_experiment(experiment, [*settings, CORE]))
    return execute(plan, target, here)


def here(folder: Path, on_progress: Callable[[Progress], None]) -> Outcome:
    """Run the federation of `folder/run.json` in this process and return how it went."""
    run = read_json(folder / "run.json")
    granted_ns = {GRID: -1, NETWORK: -1}

    def granted(name: str, k: int, at_ns: int) -> None:
        granted_ns[name] = at_ns

    began_s = time.monotonic()
    grid = GuardedParticipant(open_grid(run, folder))
    try:
        network = GuardedParticipant(open_network(run, folder))
        run_local(grid, network, Clock(**run["clock"]), granted)
    except Exception as error:
        grid.abort(str(error))
        raise
    return Outcome({"run": time.monotonic() - began_s}, granted_ns, ())


if __name__ == "__main__":
    main()
