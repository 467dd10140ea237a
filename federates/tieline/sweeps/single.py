"""Prepares and launches one run, from a process whose federates inherit what it imports."""

import importlib
import warnings
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from tieline.aside import Aside
from tieline.errors import InputError
from tieline.experiment.launch import Outcome, launch
from tieline.experiment.load import Study
from tieline.experiment.plan import prepare
from tieline.experiment.point import Task, task_of
from tieline.experiment.supervise import executed
from tieline.experiment.watch import Progress
from tieline.sweeps.fork import forked

# In this order: HELICS's ZeroMQ must not be loaded before the system's C++ runtime.
FEDERATES = ("tieline.network.federate", "tieline.grid.federate")
WITH_HELICS = ("tieline.cosim.federate", "tieline.cosim.inproc")
"""What a process imports before it forks federates; the second only for a core of HELICS."""

Steps = Iterable[Callable[[], object]]
"""What makes a process ready to fork others, in order."""


def shared_steps() -> Steps:
    """Return what the check of a case needs as well as federates do."""
    return partial(importlib.import_module, "tieline.grid.federate"), _load_models


def own_steps(core: str) -> Steps:
    """Return what only federates need.

    Args:
        core: of the federation; without HELICS, that is not loaded.
    """
    modules = FEDERATES if core == "local" else (*FEDERATES, *WITH_HELICS)
    return *(partial(importlib.import_module, module) for module in modules), _load_compiler


def planned(study: Study, shared: Steps, own: Steps) -> Task:
    """Return the task of a study's only run, checked against its case and network.

    The check is made in a fork of this process, which meanwhile takes the steps of its own.

    Args:
        study: not a sweep.
        shared: taken before, for both.
        own: taken meanwhile; a finding is told between two of them.

    Raises:
        InputError: every finding.
    """
    for step in shared:
        step()
    left = iter(own)
    with Aside(partial(_checked, study)).begin() as check:
        for step in left:
            step()
            if check.has_ended():
                break
        found = check.join()
    if "findings" in found:
        raise InputError(found["findings"])
    for step in left:
        step()
    return Task(**found["task"])


def launch_here(folder: Path, on_progress: Callable[[Progress], None]) -> Outcome:
    """Run the federation of a run folder as `launch` does, with forks of this process.

    Each federate would else import for a second or two what this process has imported already. A
    process with further threads, or of a system that cannot fork safely, starts programs instead.
    """
    start = forked if _can_fork() else executed
    with warnings.catch_warnings():
        # Python counts Arrow's thread.
        warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
        return launch(folder, on_progress, start=start)


def _checked(study: Study) -> dict[str, Any]:
    """Return the task as JSON, or what is wrong."""
    try:
        plan = prepare(study)
    except InputError as error:
        return {"findings": list(error.findings)}
    return {"task": task_of(plan.runs[0], Path()).to_json()}


def _load_models() -> None:
    from tieline.grid.models.registry import load_shipped

    load_shipped()


def _load_compiler() -> None:
    from tieline.compiled import load_compiler

    load_compiler()


def _can_fork() -> bool:
    """Return whether no thread of this process could hold a lock that a fork then waits for.

    Arrow's memory pool has a thread that sees to itself when its process is forked.
    """
    try:
        tasks = list(Path("/proc/self/task").iterdir())
        names = [(task / "comm").read_text(encoding="utf-8").strip() for task in tasks]
    except OSError:
        return False
    return len([name for name in names if name != "jemalloc_bg_thd"]) == 1
