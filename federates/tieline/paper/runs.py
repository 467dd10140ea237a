"""Runs of the federation for the items: two processes make them, one run after the other each.

All that starts a run is `Runs.start`.
"""

import hashlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Protocol

import tieline
from tieline.cosim.process import LAUNCHER_VARIABLE
from tieline.errors import CosimError, TielineError
from tieline.experiment.results import Run, read_runs
from tieline.paper.item import Spec

AT_ONCE = 2
"""One run a core on the smallest machine that one would use."""

WORKER = (sys.executable, "-m", "tieline.paper.worker")
"""What starts a process that makes runs."""


class Maker(Protocol):
    """Makes runs, one after the other."""

    def make(self, spec: Spec, target: Path) -> Path:
        """Return the result folder of a run.

        Raises:
            TielineError: the run failed.
        """

    def close(self) -> None:
        """End it, and a run that is under way."""


class MadeError(TielineError):
    """A run failed in another process; message and exit code are those of its error there."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code


class Worker:
    """A process that makes runs, started with the first."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._is_closed = False

    def make(self, spec: Spec, target: Path) -> Path:
        """Return the result folder of a run.

        Raises:
            TielineError: the run failed, or the process died.
        """
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        wanted = {"experiment": spec.experiment, "settings": spec.settings, "target": str(target)}
        try:
            process.stdin.write(json.dumps(wanted) + "\n")
            process.stdin.flush()
            answer = json.loads(process.stdout.readline())
        except (OSError, ValueError) as error:
            raise CosimError(f"the process that made {target.name} ended by itself") from error
        if "error" in answer:
            raise MadeError(answer["error"], answer["exit_code"])
        return Path(answer["folder"])

    def close(self) -> None:
        """End the process, and a run that is under way in it."""
        self._is_closed = True
        if self._process is not None:
            self._process.kill()
            self._process.communicate()

    def _started(self) -> subprocess.Popen[str]:
        if self._is_closed:
            raise CosimError("stopped")
        if self._process is None:
            self._process = subprocess.Popen(
                WORKER,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=_environment(),
                text=True,
                start_new_session=True,
            )
        return self._process


class Runs:
    """The runs that items ask for, each made once, in folders under one.

    Args:
        folder: where the result folders go.
        quick: whether items want their short form.
        maker: gives what makes runs, once for each that goes on at a time.
    """

    def __init__(
        self, folder: Path, quick: bool = False, maker: Callable[[], Maker] = Worker
    ) -> None:
        self.quick = quick
        self._folder = folder
        self._makers = [maker() for _ in range(AT_ONCE)]
        self._free = list(self._makers)
        self._lock = threading.Lock()
        # A thread does no more than wait for the process that makes the run.
        self._pool = ThreadPoolExecutor(AT_ONCE, "run")
        self._started: dict[Spec, Future[Path]] = {}

    def __enter__(self) -> "Runs":
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        for maker in self._makers:
            maker.close()
        self._pool.shutdown()

    def start(self, spec: Spec) -> None:
        """Put a run on the list, unless it is there."""
        if spec not in self._started:
            self._started[spec] = self._pool.submit(self._make, spec)

    def run(self, spec: Spec) -> Run:
        """Return the result of a run, waiting for its end.

        Raises:
            TielineError: the run failed.
        """
        self.start(spec)
        return read_runs(self._started[spec].result())[0]

    @property
    def ended(self) -> int:
        """How many of them have ended."""
        return sum(future.done() for future in self._started.values())

    def __len__(self) -> int:
        return len(self._started)

    def _make(self, spec: Spec) -> Path:
        with self._lock:
            maker = self._free.pop()
        try:
            return maker.make(spec, self._folder / _name(spec))
        finally:
            with self._lock:
                self._free.append(maker)


def _name(spec: Spec) -> str:
    """Return a folder name that tells the settings apart and begins with the experiment's name."""
    digest = hashlib.sha256("\n".join(spec.settings).encode()).hexdigest()
    return f"{spec.experiment}-{digest[:8]}"


def _environment() -> dict[str, str]:
    """Return the environment of a worker: this tieline first, and whom it is not to outlive."""
    source = str(Path(tieline.__file__).resolve().parent.parent)
    paths = [source, *filter(None, [os.environ.get("PYTHONPATH")])]
    # The matrices are small: threads of a linear algebra library cost here more than they give.
    single = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {
        **dict.fromkeys(single, "1"),
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        LAUNCHER_VARIABLE: str(os.getpid()),
    }
