"""Writes a run in HELICS's own conventions: a runner file and a file for each federate."""

import os
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.cosim.conventions import Place, broker_options, member_count, own_config
from tieline.cosim.interfaces import FEDERATES
from tieline.cosim.runfile import HELICS_OPTION, federation_of
from tieline.errors import InputError
from tieline.experiment.guests import guest_processes
from tieline.experiment.manifest import run_manifest, save_manifest, write_json
from tieline.experiment.plan import Plan, PlannedRun
from tieline.experiment.supervise import shared_environment

RUNNER = "runner.json"
NOT_GATHERED = "its federates were not started by tieline, or `tieline gather` has not come yet"


def single_run(plan: Plan, what: str) -> PlannedRun:
    """Return the one run of a plan.

    Raises:
        InputError: it is a sweep.
    """
    if plan.study.is_sweep:
        raise InputError(
            f"{what} takes one run, and {plan.study.name} sweeps {len(plan.runs)}:"
            " add --set sweep=[] and the settings of the point that you want"
        )
    return plan.runs[0]


def check_empty(folder: Path) -> None:
    """Refuse a folder that holds something.

    Raises:
        InputError: it does, or it is a file.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"--out {folder} is not empty: give a new or an empty folder")


def lay_out(planned: PlannedRun, folder: Path, **federation: Any) -> dict[str, Any]:
    """Make a run's folder for federates that no launcher watches; return its run file's content.

    Args:
        planned: the run.
        folder: new, or empty.
        federation: what to put over the run file's federation: where it meets.

    Raises:
        InputError: the folder holds something.
    """
    check_empty(folder)
    folder.mkdir(parents=True, exist_ok=True)
    run = dict(planned.run) | {"leaves_word": True}
    run["federation"] = {**planned.run["federation"], **federation}
    write_json(folder / "run.json", run)
    save_manifest(folder, run_manifest(planned, {}, NOT_GATHERED))
    return run


def export_helics(planned: PlannedRun, folder: Path, port: int) -> Path:
    """Return the runner file of a run, written with everything it needs.

    `helics run --path=FOLDER/runner.json` then starts broker, federates and guests; their tables
    and logs come into the folder.

    Raises:
        InputError: the folder is not empty, or the core is none that processes meet over.
    """
    core = planned.run["federation"]["core"]
    if core not in ("zmq", "tcp"):
        raise InputError(f"export-helics needs federation.core zmq or tcp (got {core})")
    run = lay_out(planned, folder, broker_port=port)
    settings, place = federation_of(run)
    federates = [_broker(run, place)]
    for name in FEDERATES:
        config = own_config(name, run, place, settings.start_timeout)
        write_json(folder / f"{name}.json", config)
        words = [sys.executable, "-m", f"tieline.{name}", "run.json", HELICS_OPTION, f"{name}.json"]
        federates.append(_federate(name, words, "."))
    for guest in guest_processes(run, folder):
        federates.append(_federate(guest.name, guest.command, str(guest.directory)))
    runner = {"name": str(run["run_id"]), "broker": False, "federates": federates}
    write_json(folder / RUNNER, runner)
    return folder / RUNNER


def _broker(run: Mapping[str, Any], place: Place) -> dict[str, Any]:
    options = broker_options(place, member_count(run))
    words = [_program("helics_broker"), f"--coretype={place.core}", *options.split()]
    return _federate("broker", words, ".")


def _federate(name: str, words: Any, directory: str) -> dict[str, Any]:
    return {
        "name": name,
        "host": "localhost",
        "directory": directory,
        "exec": shlex.join([_program(words[0]), *words[1:]]),
        "env": {key: value for key, value in shared_environment({}).items() if key != "PATH"},
    }


def _program(name: str) -> str:
    """Return this environment's own program of a name, where it has one."""
    own = Path(sys.executable).parent / name
    return str(own) if os.sep not in name and own.is_file() else name
