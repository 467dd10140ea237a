"""Runs the points of a sweep into one folder: what is finished stays, what failed is listed."""

import shutil
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

from tieline.errors import InputError, TielineError
from tieline.experiment.folder import UNDER_WAY, held, write_json
from tieline.experiment.interrupts import interruptible
from tieline.experiment.keeper import kept
from tieline.experiment.manifest import save_manifest, sweep_manifest
from tieline.experiment.plan import Plan
from tieline.experiment.point import (
    Launch,
    Task,
    is_finished,
    reason_of,
    run_task,
    task_of,
    work_folder,
)
from tieline.experiment.results import POINTS, SUMMARY, is_result, read_manifest, read_runs
from tieline.experiment.sweep import Point

MOST_LISTED = 20
"""Failed points that a message names."""


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


class PointsFailedError(RunFailedError):
    """Some points of a sweep failed; the others are complete.

    Attributes:
        failures: the error of each failed point, by its label, in the sweep's order.
    """

    def __init__(self, failures: dict[str, TielineError], count: int, folder: Path) -> None:
        lines = [f"{len(failures)} of {count} points failed (the whole story is in points/):"]
        told = [(label, str(error).splitlines()[0]) for label, error in failures.items()]
        lines += [f"  {label}: {line}" for label, line in told[:MOST_LISTED]]
        if len(told) > MOST_LISTED:
            lines.append(f"  and {len(told) - MOST_LISTED} more")
        first = next(iter(failures.values()))
        summary = TielineError("\n".join(lines))
        summary.exit_code = first.exit_code
        super().__init__(summary, folder)
        self.failures = failures


@dataclass(frozen=True)
class Ended:
    """How one task ended: which of those given, and the error if it failed."""

    index: int
    error: TielineError | None = None


OnTime = Callable[[int, float], None]
"""Is told which task has reached what simulated time, s."""


class Runner(Protocol):
    """Runs tasks somewhere, in whatever order."""

    def run(self, tasks: Sequence[Task], on_time: OnTime) -> Generator[Ended, None, None]:
        """Yield each task as it ends; its folder is then in place. Closing it ends all."""


@dataclass(frozen=True)
class Listener:
    """What is told of a sweep's course.

    Attributes:
        on_time: the simulated time that a point has reached, s.
        on_kept: the points that were finished before.
        on_end: a point that has ended, and its error if it failed.
    """

    on_time: Callable[[Point, float], None] | None = None
    on_kept: Callable[[Sequence[Point]], None] | None = None
    on_end: Callable[[Point, TielineError | None], None] | None = None


class InTurn:
    """Runs one task after another from this process."""

    def __init__(self, launch: Launch) -> None:
        self._launch = launch

    def run(self, tasks: Sequence[Task], on_time: OnTime) -> Generator[Ended, None, None]:
        """Yield each task as it ends, in the order given."""
        for i, task in enumerate(tasks):
            try:
                run_task(work_folder(task), task, self._launch, partial(on_time, i))
            except TielineError as error:
                yield Ended(i, error)
            except Exception as error:
                yield Ended(i, TielineError(reason_of(error)))
            else:
                yield Ended(i)


def run_sweep(
    plan: Plan,
    target: Path,
    runner: Runner,
    listener: Listener = Listener(),
    is_fresh: bool = False,
) -> Path:
    """Run the points of a sweep that are not yet finished in `target`, and return the folder.

    A point is finished if its run is complete and had the same settings, inputs and version. The
    folder grows point by point, and has manifest, summary and table at any time that this function
    is left, however it is left.

    Args:
        plan: the sweep.
        target: the result folder to make or to go on with.
        runner: runs the points.
        listener: what is told of the course.
        is_fresh: run finished points again, too.

    Raises:
        InputError: the target holds something else, or cannot be written.
        PointsFailedError: points failed; all others are complete.
    """
    _open_folder(plan, target)
    with _alone_in(target):
        return _run_due(plan, target, runner, listener, is_fresh)


def _run_due(plan: Plan, target: Path, runner: Runner, listener: Listener, is_fresh: bool) -> Path:
    tasks = [task_of(run, target / POINTS / run.point.slug) for run in plan.runs]
    due = [i for i, task in enumerate(tasks) if is_fresh or not _is_done(task)]
    points = [run.point for run in plan.runs]
    if listener.on_kept is not None:
        listener.on_kept([points[i] for i in range(len(points)) if i not in due])
    reason: str | None = UNDER_WAY
    _discard(tasks[i] for i in due)
    save_manifest(target, sweep_manifest(plan, reason))
    try:
        with interruptible(), kept(target.resolve(), target.resolve()):
            failures = _failures(runner, {i: tasks[i] for i in due}, points, listener)
        reason = _told(failures, len(points))
    except BaseException as error:
        reason = reason_of(error)
        raise
    finally:
        _close_folder(plan, target, reason)
    if failures:
        named = {points[i].label: failures[i] for i in sorted(failures)}
        raise PointsFailedError(named, len(points), target)
    return target


def _failures(
    runner: Runner, tasks: Mapping[int, Task], points: Sequence[Point], listener: Listener
) -> dict[int, TielineError]:
    """Run the tasks of some points, by their places, and return the errors of those that failed."""
    places = list(tasks)
    failures: dict[int, TielineError] = {}
    if not tasks:
        return failures

    def on_time(index: int, time_s: float) -> None:
        if listener.on_time is not None:
            listener.on_time(points[places[index]], time_s)

    with closing(runner.run(list(tasks.values()), on_time)) as course:
        for ended in course:
            place = places[ended.index]
            if ended.error is not None:
                failures[place] = ended.error
            if listener.on_end is not None:
                listener.on_end(points[place], ended.error)
    return failures


def _open_folder(plan: Plan, target: Path) -> None:
    """Make the folder, or find that the sweep can go on in it.

    Raises:
        InputError: it holds another result, or cannot be written.
    """
    if is_result(target):
        found = read_manifest(target)
        if (found["kind"], found["name"]) != ("sweep", plan.study.name):
            raise InputError(
                f"{target} holds the {found['kind']} '{found['name']}', and no sweep"
                f" '{plan.study.name}' to go on with: give another folder"
            )
    try:
        (target / POINTS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {target} cannot be written ({error.strerror})") from error


@contextmanager
def _alone_in(target: Path) -> Iterator[None]:
    """Hold the folder's lock, which ends with this process at the latest.

    Raises:
        InputError: another sweep is at work in it.
    """
    with held(target) as is_free:
        if not is_free:
            raise InputError(
                f"another sweep is at work in {target}: wait for its end, or give another folder"
            )
        yield


def _close_folder(plan: Plan, target: Path, reason: str | None) -> None:
    complete = [run for run in read_runs(target) if run.is_complete]
    summaries = [run.summary() for run in complete]
    write_json(target / SUMMARY, {"name": plan.study.name, "points": summaries})
    save_manifest(target, sweep_manifest(plan, reason))
    # It brings pandas with it, for which a single run's federates should not wait.
    from tieline.experiment.points_table import write_points

    write_points(target)


def _is_done(task: Task) -> bool:
    return is_finished(Path(task.folder), task.manifest)


def _discard(tasks: Iterable[Task]) -> None:
    """Remove what earlier attempts left of the tasks to run."""
    for task in tasks:
        folder = Path(task.folder)
        for left in [folder, *folder.parent.glob(f".{folder.name}.partial-*")]:
            if left.exists():
                shutil.rmtree(left)


def _told(failures: dict[int, TielineError], count: int) -> str | None:
    if not failures:
        return None
    first = failures[min(failures)]
    return f"{len(failures)} of {count} points failed, the first with: {first}"
