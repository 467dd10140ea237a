"""Runs a plan: one folder a run, named in the end, marked for what it is when it fails."""

import os
import shutil
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from tieline.cosim.interfaces import GRID
from tieline.errors import InputError, TielineError
from tieline.experiment.launch import Outcome
from tieline.experiment.manifest import (
    run_facts,
    run_manifest,
    save_manifest,
    sweep_manifest,
    write_json,
)
from tieline.experiment.plan import Plan, PlannedRun
from tieline.experiment.results import (
    MAP,
    POINTS,
    SUMMARY,
    Run,
    is_result,
    read_manifest,
    read_runs,
)
from tieline.experiment.summary import summarise
from tieline.experiment.sweep import Point
from tieline.experiment.watch import Progress
from tieline.tables import salvage
from tieline.units import ns_to_seconds

UNDER_WAY = "the run did not end: it is under way, or was killed"

Launch = Callable[[Path, Callable[[Progress], None]], Outcome]
"""Runs the federation of a folder's run.json to its end, or raises a CosimError."""


class RunFailedError(TielineError):
    """A run ended early; what it wrote is kept.

    Attributes:
        folder: the result folder, marked incomplete.
        exit_code: that of the error that ended the run.
    """

    def __init__(self, error: TielineError, folder: Path) -> None:
        super().__init__(f"{error}\nwhat was written is in {folder}, marked incomplete")
        self.folder = folder
        self.exit_code = error.exit_code


def default_target(name: str) -> Path:
    """Return a folder of its own for a run that names none."""
    return Path("results") / f"{name}-{datetime.now().strftime('%Y%m%d-%H%M%S')}"


def check_target(target: Path) -> None:
    """Refuse a target that would overwrite what is no result.

    Raises:
        InputError: the target is a file, or a folder with something else in it.
    """
    if target.exists() and not target.is_dir():
        raise InputError(f"--out {target} is a file: give a folder")
    if target.is_dir() and any(target.iterdir()) and not is_result(target):
        raise InputError(
            f"--out {target} holds files that are no result of tieline:"
            " give a new or empty folder, or an earlier result to replace"
        )


def execute(
    plan: Plan,
    target: Path,
    launch: Launch,
    on_progress: Callable[[Point, float], None] | None = None,
) -> Path:
    """Run every point of a plan in order, and return the result folder.

    The folder is written beside the target under a temporary name and takes the target's name at
    the end, replacing an earlier result there. If a run fails, what was written is kept, marked
    incomplete; an earlier result at the target is then left alone.

    Args:
        plan: what to run.
        target: the result folder to make.
        launch: starts the federates.
        on_progress: is told the point and the simulated time that it has reached, s.

    Raises:
        InputError: the target is not free, or cannot be written.
        RunFailedError: a run failed.
    """
    check_target(target)
    work = _work_folder(target)
    try:
        _run_all(plan, work, launch, on_progress)
    except TielineError as error:
        kept = _keep_incomplete(plan, work, target, error)
        raise RunFailedError(error, kept) from error
    except BaseException as error:
        _keep_incomplete(plan, work, target, error)
        raise
    _move(work, target)
    return target


def _run_all(
    plan: Plan, work: Path, launch: Launch, on_progress: Callable[[Point, float], None] | None
) -> None:
    if not plan.study.is_sweep:
        _run_one(plan.runs[0], work, launch, on_progress)
        return
    save_manifest(work, sweep_manifest(plan.runs, UNDER_WAY))
    for planned in plan.runs:
        folder = work / POINTS / planned.point.slug
        folder.mkdir(parents=True)
        _run_one(planned, folder, launch, on_progress)
    summaries = [run.summary() for run in read_runs(work)]
    write_json(work / SUMMARY, {"name": plan.study.name, "points": summaries})
    save_manifest(work, sweep_manifest(plan.runs, None))


def _run_one(
    planned: PlannedRun,
    folder: Path,
    launch: Launch,
    on_progress: Callable[[Point, float], None] | None,
) -> None:
    write_json(folder / "run.json", planned.run)
    if planned.interconnection is not None:
        from tieline.experiment.interconnection import placed

        write_json(folder / MAP, placed(planned.interconnection))
    save_manifest(folder, run_manifest(planned, {}, UNDER_WAY))

    def report(progress: Progress) -> None:
        if on_progress is not None and progress.federate == GRID:
            on_progress(planned.point, ns_to_seconds(max(0, progress.granted_ns)))

    outcome = None
    try:
        outcome = launch(folder, report)
        facts = run_facts(outcome, folder)
        write_json(folder / SUMMARY, summarise(Run(folder, run_manifest(planned, facts, None))))
    except BaseException as error:
        salvage(folder)
        facts = run_facts(getattr(error, "outcome", outcome), folder)
        save_manifest(folder, run_manifest(planned, facts, _reason(error)))
        raise
    save_manifest(folder, run_manifest(planned, facts, None))


def _work_folder(target: Path) -> Path:
    work = target.parent / f".{target.name}.partial-{os.getpid()}"
    try:
        work.mkdir(parents=True)
    except OSError as error:
        raise InputError(f"--out {target} cannot be written ({error.strerror})") from error
    return work


def _keep_incomplete(plan: Plan, work: Path, target: Path, error: BaseException) -> Path:
    """Mark a failed result, give it a name that overwrites nothing whole, and return that."""
    if plan.study.is_sweep:
        save_manifest(work, sweep_manifest(plan.runs, _reason(error)))
    has_older = is_result(target) and read_manifest(target)["status"] == "complete"
    kept = target.with_name(f"{target.name}-incomplete") if has_older else target
    _move(work, kept)
    return kept


def _move(work: Path, target: Path) -> None:
    older = work.with_name(f"{work.name}-older")
    if target.is_dir() and any(target.iterdir()):
        target.rename(older)
    work.rename(target)
    if older.exists():
        shutil.rmtree(older)


def _reason(error: BaseException) -> str:
    if isinstance(error, KeyboardInterrupt):
        return "interrupted from the keyboard"
    return str(error) if isinstance(error, TielineError) else f"{type(error).__name__}: {error}"
