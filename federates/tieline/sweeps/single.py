"""Launches one run from the process that planned it, whose federates inherit its imports."""

import importlib
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from tieline.experiment.launch import Outcome, launch
from tieline.experiment.supervise import executed, shared_environment
from tieline.experiment.watch import Progress
from tieline.sweeps.fork import forked

# In this order: HELICS's ZeroMQ must not be loaded before the system's C++ runtime.
FEDERATES = ("tieline.network.federate", "tieline.grid.federate")
WITH_HELICS = ("tieline.cosim.federate", "tieline.cosim.inproc")
"""What a process imports before it forks federates; the second only for a core of HELICS."""

_AFTERWARDS = ("tieline.experiment.report", "matplotlib.backends.backend_agg")
"""What only the end of a run needs, imported while it runs."""


def settle_environment() -> None:
    """Give this process the variables that those forked from it must find before any import."""
    for name, value in shared_environment(os.environ).items():
        if name.endswith("_NUM_THREADS"):
            os.environ.setdefault(name, value)


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

    if not sys.platform.startswith("linux") or threading.active_count() > 1:
        return launch(folder, heard, start=executed)
    for module in (*FEDERATES, *WITH_HELICS):
        importlib.import_module(module)
    outcome = launch(folder, heard, start=forked)
    ahead.join()
    return outcome


def _import_ahead() -> None:
    for module in _AFTERWARDS:
        importlib.import_module(module)
