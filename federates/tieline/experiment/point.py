"""Runs one point in its folder, wherever that is: told by plain data, and marked for what it is."""

import os
import shutil
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import tieline
from tieline.cosim.interfaces import GRID
from tieline.errors import CosimError, InputError, TielineError
from tieline.experiment.folder import (
    MANIFEST,
    RESERVE,
    UNDER_WAY,
    clear,
    put_in_place,
    write_json,
)
from tieline.experiment.interrupts import current_interrupts, interruptible
from tieline.experiment.launch import Outcome
from tieline.experiment.manifest import ended, run_facts, run_manifest, save_manifest, versions
from tieline.experiment.plan import PlannedRun
from tieline.experiment.rescue import LAUNCHER, granted_text
from tieline.experiment.results import MAP, SUMMARY, Run, is_result, read_manifest
from tieline.experiment.summary import summarise
from tieline.experiment.watch import Progress
from tieline.tables import salvage
from tieline.units import ns_to_seconds

_RESERVE_BYTES = 262_144

Launch = Callable[[Path, Callable[[Progress], None]], Outcome]
"""Runs the federation of a folder's run.json to its end, or raises a CosimError."""

OnTime = Callable[[float], None]
"""Is told the simulated time that a run has reached, s."""

OnProgress = Callable[[Progress], None]


@dataclass(frozen=True)
class Task:
    """All that whoever runs a point must know; plain data that JSON carries unchanged.

    Attributes:
        folder: where the result belongs in the end, absolute.
        files: content of the JSON files that the run begins with, by their names.
        manifest: of the run as it is under way.
    """

    folder: str
    files: Mapping[str, Any]
    manifest: Mapping[str, Any]

    def to_json(self) -> dict[str, Any]:
        """Return the task as JSON carries it."""
        return asdict(self)


def task_of(planned: PlannedRun, folder: Path) -> Task:
    """Return the task of one planned run whose result belongs into `folder`."""
    files: dict[str, Any] = {"run.json": dict(planned.run)}
    if planned.interconnection is not None:
        from tieline.experiment.interconnection import placed

        files[MAP] = placed(planned.interconnection)
    return Task(str(folder.resolve()), files, run_manifest(planned, {}, UNDER_WAY))


def run_in(
    work: Path,
    task: Task,
    launch: Launch,
    on_time: OnTime | None = None,
    on_progress: OnProgress | None = None,
) -> None:
    """Run a task in the folder `work`, which exists and is empty.

    If it fails, what was written is made readable and marked incomplete with the reason.

    Raises:
        TielineError: the run failed.
    """
    # Who runs it is what made it, whoever planned it.
    base = {**task.manifest, "versions": versions()}

    def report(progress: Progress) -> None:
        if on_progress is not None:
            on_progress(progress)
        if on_time is not None and progress.federate == GRID:
            on_time(ns_to_seconds(max(0, progress.granted_ns)))

    outcome = None
    try:
        _begin(work, task, base)
        outcome = launch(work, report)
        facts = run_facts(outcome, work, base["seed"])
        write_json(work / SUMMARY, summarise(Run(work, ended(base, facts, None))))
        (work / RESERVE).unlink()
        save_manifest(work, ended(base, facts, None))
    except BaseException as error:
        own = _own(error, outcome)
        with current_interrupts().hold():
            _save_incomplete(work, base, getattr(own, "outcome", outcome), own)
        if own is error:
            raise
        raise own from error


def _begin(work: Path, task: Task, base: Mapping[str, Any]) -> None:
    for name, content in task.files.items():
        write_json(work / name, content)
    save_manifest(work, base)
    (work / RESERVE).write_bytes(bytes(_RESERVE_BYTES))


def _own(error: BaseException, outcome: Outcome | None) -> BaseException:
    """Return an error of this process's as the launcher's, with its file; any other as it is."""
    if not isinstance(error, OSError):
        return error
    where = "" if error.filename is None else f" ({Path(error.filename).name})"
    granted = "" if outcome is None else granted_text(outcome.granted_ns)
    return CosimError(f"{LAUNCHER}: {error.strerror or error}{where}{granted}")


def _save_incomplete(
    work: Path, base: Mapping[str, Any], outcome: Outcome | None, error: BaseException
) -> None:
    """Make readable what was written, and say in the manifest why it is not whole."""
    reserve = work / RESERVE
    try:
        if reserve.is_file():
            # The manifest keeps its part: tables could take all the room there is.
            os.truncate(reserve, _RESERVE_BYTES // 2)
        salvage(work)
        clear(work)
        facts = run_facts(outcome, work, base["seed"])
        save_manifest(work, ended(base, facts, reason_of(error)))
    except (OSError, TielineError) as second:
        error.add_note(f"what was written could not all be made readable: {second}")
        with suppress(OSError):
            save_manifest(work, ended(base, {}, reason_of(error)))


def run_task(work: Path, task: Task, launch: Launch, on_time: OnTime | None = None) -> None:
    """Run a task in `work`, a folder to make, and move it to its own folder at the end.

    Whatever stood there is replaced, but not by an interrupted run, and a finished run of the same
    settings stays: another may have run the same point at the same time.

    Raises:
        TielineError: the run failed; its folder is marked incomplete. The same holds for any other
            error.
    """
    check_version(task)
    work.mkdir(parents=True)
    with interruptible() as interrupts:
        try:
            run_in(work, task, launch, on_time)
        except Exception:
            if is_result(work):
                put(work, Path(task.folder))
            else:
                shutil.rmtree(work, ignore_errors=True)
            raise
        except BaseException:
            shutil.rmtree(work, ignore_errors=True)
            raise
        with interrupts.hold():
            put(work, Path(task.folder))


def work_folder(task: Task) -> Path:
    """Return where a task is run before it has its place: beside it, and no other attempt's."""
    folder = Path(task.folder)
    return folder.with_name(f".{folder.name}.partial-{socket.gethostname()}-{os.getpid()}")


def put(work: Path, folder: Path) -> None:
    """Give a run that has ended its place; a finished run of the same settings goes first."""
    if is_finished(folder, read_manifest(work)):
        shutil.rmtree(work)
        return
    put_in_place(work, folder)


def is_finished(folder: Path, wanted: Mapping[str, Any]) -> bool:
    """Return whether a folder holds a complete run of the settings, inputs and version wanted.

    Args:
        folder: a run's, or one that does not exist.
        wanted: a manifest of the run, complete or not.
    """
    if not is_result(folder) or not (folder / SUMMARY).is_file():
        return False
    found = read_manifest(folder)
    return found["status"] == "complete" and _identity(found) == _identity(wanted)


def mark_lost(work: Path, task: Task, reason: str) -> None:
    """Keep what is left of a run whose own process is gone, marked incomplete with the reason.

    Raises:
        OSError: the disk is full, or fails.
    """
    if not (work / MANIFEST).is_file():
        shutil.rmtree(work, ignore_errors=True)
        return
    salvage(work)
    clear(work)
    facts = run_facts(None, work, task.manifest["seed"])
    save_manifest(work, ended(task.manifest, facts, reason))
    put(work, Path(task.folder))


def check_version(task: Task) -> None:
    """Refuse to run what another version planned.

    Raises:
        CosimError: this host has another version of tieline.
        InputError: the folder of the whole result is not seen from here.
    """
    planned = task.manifest["versions"]["tieline"]
    if planned != tieline.__version__:
        raise CosimError(
            f"host {socket.gethostname()} has tieline {tieline.__version__}, but the sweep was"
            f" planned by {planned}: install the same version on every host"
        )
    points = Path(task.folder).parent
    if not points.is_dir():
        raise InputError(
            f"host {socket.gethostname()} sees no folder {points}: every worker must see the"
            " result folder and the case under the same paths (a shared file system)"
        )


def reason_of(error: BaseException) -> str:
    """Return why a run is incomplete."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted from the keyboard"
    return str(error) if isinstance(error, TielineError) else f"{type(error).__name__}: {error}"


def _identity(manifest: Mapping[str, Any]) -> tuple[Any, ...]:
    version = manifest["versions"]["tieline"]
    return manifest["run_id"], manifest["config_hash"], manifest["inputs"], version
