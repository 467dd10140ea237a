"""`tieline run` without physics: `program.py CORE [GUEST]` runs dummies into the folder `out`."""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import typer

from cosim.dummy import COMMANDS
from faults.trial import write_guest
from synthetic_result import EXPERIMENT, plan_of
from tieline.console import reporting
from tieline.experiment.launch import launch
from tieline.experiment.plan import Plan
from tieline.experiment.run import execute

ENDLESS = 100_000
PAUSE_S = 0.02


def planned(core: str, has_guest: bool) -> Plan:
    """Return the plan of dummies that meet without end; the grid's records what it was granted."""
    text = f"{EXPERIMENT}federation:\n  core: {core}\n"
    plan = plan_of(Path.cwd(), text + (write_guest(Path.cwd()) if has_guest else ""))
    [planned_run] = plan.runs
    dummies = {"grid": {"pause_s": PAUSE_S, "records": True}, "network": {"pause_s": PAUSE_S}}
    clock = {"rate_hz": 60, "intervals": ENDLESS, "lead": 0}
    run = {**planned_run.run, "clock": clock, "dummy": dummies}
    return replace(plan, runs=(replace(planned_run, run=run),))


if __name__ == "__main__":
    try:
        with reporting():
            plan = planned(sys.argv[1], "GUEST" in sys.argv[2:])
            execute(plan, Path("out"), partial(launch, commands=COMMANDS))
    except typer.Exit as end:
        sys.exit(end.exit_code)
