"""Launches one run from the process that planned it, whose federates inherit its imports."""

import importlib
import threading
import warnings
from collections.abc import Callable
from pathlib import Path

from tieline.experiment.launch import Outcome, launch
from tieline.experiment.supervise import executed
from tieline.experiment.watch import Progress
from tieline.sweeps.fork import forked

# In this order: HELICS's ZeroMQ must not be loaded before the system's C++ runtime.
FEDERATES = ("tieline.network.federate", "tieline.grid.federate")
WITH_HELICS = ("tieline.cosim.federate", "tieline.cosim.inproc")
"""What a process imports before it forks federates; the second only for a core of HELICS."""

_AFTERWARDS = ("tieline.experiment.report", "matplotlib.backends.backend_agg")
"""What only the end of a run needs, imported while it runs."""


def launch_here(folder: Path, on_progress: Callable[[Progress], None]) -> Outcome:
    """Run the federation of a run folder as `launch` does, with forks of this process.

    Each federate would else import for a second or two what this process has imported already. A
    process with further threads, or of a system that cannot fork safely, starts programs instead.
    """
    ahead = threading.Thread(target=_import_ahead, name="imports", daemon=True)

    def heard(progress: Progress) -> None:
        if not ahead.ident:
            ahead.start()
        on_progress(progress)

    for module in (*FEDERATES, *WITH_HELICS):
        importlib.import_module(module)
    from tieline.compiled import load_compiler

    load_compiler()
    start = forked if _can_fork() else executed
    with warnings.catch_warnings():
        # Python counts Arrow's thread.
        warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
        outcome = launch(folder, heard, start=start)
    if ahead.ident:
        ahead.join()
    return outcome


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


def _import_ahead() -> None:
    for module in _AFTERWARDS:
        importlib.import_module(module)
