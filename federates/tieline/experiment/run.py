"""Runs a plan: one folder a run, named in the end, marked for what it is when it fails."""

import glob
import itertools
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime
from functools import partial
from pathlib import Path

from tieline.errors import InputError, TielineError
from tieline.experiment.folder import (
    held,
    is_free,
    is_result,
    place_of_incomplete,
    put_in_place,
    read_manifest,
    waited_for,
)
from tieline.experiment.interrupts import interruptible
from tieline.experiment.keeper import kept
from tieline.experiment.plan import Plan
from tieline.experiment.point import Launch, OnTime, Task, run_in, task_of
from tieline.experiment.rescue import take_up
from tieline.experiment.sweep import Point
from tieline.experiment.sweep_run import InTurn, Listener, RunFailedError, run_sweep

__all__ = ["Launch", "RunFailedError", "check_target", "default_target", "execute", "execute_task"]


def default_target(name: str) -> Path:
    """Make and return a folder of its own, empty, for a run that names none.

    Raises:
        InputError: there is no place for it.
    """
    first = Path("results") / f"{name}-{datetime.now().strftime('%Y%m%d-%H%M%S')}"
    for number in itertools.count(1):
        target = first if number == 1 else first.with_name(f"{first.name}-{number}")
        try:
            target.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise InputError(f"{target} cannot be written ({error.strerror})") from error
        return target
    raise AssertionError("counting ends nowhere")


def check_target(target: Path) -> None:
    """Refuse a target that would overwrite what is no result.

    Raises:
        InputError: the target is a file, a folder with something else in it, or one around here.
    """
    if target.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise InputError(f"--out {target} is the folder you are in, or around it: give one inside")
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

    The folder of a single run is written beside the target under a temporary name and takes the
    target's name at the end, replacing an earlier result there. If the run fails, what was written
    is kept, marked incomplete; an earlier result at the target is then left alone. If this process
    is killed the run's keeper sees to that, and if the keeper is killed, too, the next run beside
    it does. A sweep goes on in its folder, as `run_sweep` does.

    Args:
        plan: what to run.
        target: the result folder to make.
        launch: starts the federates.
        on_progress: is told the point and the simulated time that it has reached, s.

    Raises:
        InputError: the target is not free, another run is under way to it, or it cannot be written.
        RunFailedError: a run failed.
    """
    if plan.study.is_sweep:
        check_target(target)
        take_up(target.parent)
        return run_sweep(plan, target, InTurn(launch), Listener(on_progress))
    on_time = None if on_progress is None else partial(on_progress, plan.runs[0].point)
    return execute_task(task_of(plan.runs[0], target), target, launch, on_time)


def execute_task(task: Task, target: Path, launch: Launch, on_time: OnTime | None = None) -> Path:
    """Run the task of a single run as `execute` does, and return its folder.

    Args:
        task: whose result belongs into `target`, whatever folder it names.
        target: the result folder to make.
        launch: starts the federates.
        on_time: is told the simulated time that the run has reached, s.

    Raises:
        InputError: the target is not free, another run is under way to it, or it cannot be written.
        RunFailedError: the run failed.
    """
    check_target(target)
    take_up(target.parent)
    with (
        interruptible() as interrupts,
        _own_folder(target) as work,
        kept(work.resolve(), target.resolve()) as keeper,
    ):
        try:
            run_in(work, task, launch, on_time, keeper.note)
        except TielineError as error:
            with interrupts.hold():
                folder = _keep_incomplete(work, target)
            raise RunFailedError(error, folder) from error
        except BaseException:
            with interrupts.hold():
                _keep_incomplete(work, target)
            raise
        with interrupts.hold():
            put_in_place(work, target)
    return target


def _work_folder(target: Path) -> Path:
    work = target.parent / f".{target.name}.partial-{os.getpid()}"
    try:
        work.mkdir(parents=True)
    except OSError as error:
        raise InputError(f"--out {target} cannot be written ({error.strerror})") from error
    return work


@contextmanager
def _own_folder(target: Path) -> Iterator[Path]:
    """Make and hold the folder in which a run is written; give it while no other run has one.

    Raises:
        InputError: another run is under way to the same target, or it cannot be written there.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {target} cannot be written ({error.strerror})") from error
    with ExitStack() as stack:
        with waited_for(target.parent):
            for other in target.parent.glob(f".{glob.escape(target.name)}.partial-*"):
                if not is_free(other):
                    raise InputError(
                        f"--out {target}: another run is under way there ({other.name}); give"
                        " another folder, or wait for its end"
                    )
            work = _work_folder(target)
            stack.enter_context(held(work))
        yield work


def _keep_incomplete(work: Path, target: Path) -> Path:
    """Give a failed result a name that overwrites nothing whole, and return that."""
    if not is_result(work):
        # It failed before there was anything to keep.
        shutil.rmtree(work, ignore_errors=True)
        return target
    is_whole = read_manifest(work)["status"] == "complete"
    folder = target if is_whole else place_of_incomplete(target)
    put_in_place(work, folder)
    return folder
