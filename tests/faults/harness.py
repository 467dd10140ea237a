"""Runs one federation, does it one harm, and looks whether what tieline promises still held.

A trial starts `tieline run`, or the stand-in of `program.py`, in a folder of its own, with a mark
in the environment that every process of it inherits. It waits for a phase of the run, then for a
while, harms one process, waits for the end and looks: at the time that took, exit code and words,
at what is left of processes, listening ports and files, and at the result folder.
"""

import json
import os
import re
import resource
import signal
import subprocess
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from faults.looking import look_at_result, read
from faults.trial import VISITOR, Finding, Trial
from tieline.tables import read_whole

END_WITHIN_S = 10.0
CLEAN_WITHIN_S = 2.0
"""Both where a core is free: on a busy machine, as many times longer as there are processes that
want to run on each core."""
PATIENCE_S = 200.0
START_S = 120.0
BLOCK = 100

_MARK = "TIELINE_TRIAL"
_LOOK_S = 0.02
_LISTENS = "0A"
_COMMANDS = {
    # A fork's name, of which the kernel keeps 15 letters, comes before its command line.
    "broker": r"tieline\.cosim\.broker|^tieline-broker",
    "grid": r"tieline\.grid\b|dummy\.py\0grid\0|^tieline-grid",
    "network": r"tieline\.network\b|dummy\.py\0network\0|^tieline-network",
    "together": r"tieline\.cosim\.together|dummy\.py\0together\0|^tieline-togethe",
    "keeper": r"strays\.py",
    VISITOR: r"guest\.py",
}
_SIGNALS = {"KILL": signal.SIGKILL, "STOP": signal.SIGSTOP, "TERM": signal.SIGTERM}


def harm(
    trial: Trial, command: Sequence[str], folder: Path, end_within_s: float = END_WITHIN_S
) -> Finding:
    """Return what came of a trial.

    Args:
        trial: the harm.
        command: starts a run whose result folder is `out` in `folder`, the working directory.
        folder: empty, or with what the command needs and an earlier result.
        end_within_s: longest time from the fault to the end.
    """
    run = _Run(command, folder)
    finding = Finding(trial)
    try:
        _await_phase(run, trial)
        run.note_ports()
        time.sleep(trial.after_s)
        begin_s = time.monotonic()
        _inflict(run, trial)
        _await_end(run, trial, finding, begin_s)
        if finding.end_s > end_within_s * finding.busy and not run.is_whole():
            finding.broken.append(f"it took {finding.end_s:.1f} s to end")
        finding.broken += _look(run, trial, finding)
    except TimeoutError as error:
        finding.broken.append(str(error))
    finally:
        run.clear()
    return finding


class _Run:
    """A launcher with all that it starts."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self.folder = folder
        self.out = folder / "out"
        self.ports: range | None = None
        self._mark = f"{_MARK}={uuid.uuid4().hex}"
        self._temporary = folder / "tmp"
        self._temporary.mkdir()
        (folder / "cwd").mkdir()
        name, _, value = self._mark.partition("=")
        environment = {**os.environ, name: value, "TMPDIR": str(self._temporary)}
        with (folder / "said").open("wb") as said, (folder / "told").open("wb") as told:
            self.launcher = subprocess.Popen(
                command,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=told,
                stderr=said,
                # As a shell does it: the group is what a terminal sends Ctrl-C to.
                process_group=0,
            )

    @property
    def said(self) -> str:
        """What it said on standard error."""
        return (self.folder / "said").read_text(encoding="utf-8", errors="replace")

    def is_alive(self) -> bool:
        """Return whether the launcher lives."""
        return self.launcher.poll() is None

    def work(self) -> Path | None:
        """Return the folder that the run is written in, None before and after."""
        return next(iter(self.folder.glob(".out.partial-*")), None)

    def is_whole(self) -> bool:
        """Return whether the new result has its place."""
        manifest = read(self.out / "manifest.json")
        return manifest.get("status") == "complete" and manifest["label"] != "older"

    def note_ports(self) -> None:
        """Remember which ports the run has reserved."""
        work = self.work()
        if work is not None:
            with suppress(OSError, ValueError):
                run = json.loads((work / "run.json").read_text())
                port = run["federation"].get("broker_port")
                self.ports = None if port is None else range(port, port + BLOCK)

    def processes(self) -> dict[int, str]:
        """Return every living process of the run: its name and its command line, apart by NUL."""
        found = {}
        mark = self._mark.encode()
        for path in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                if mark in (path / "environ").read_bytes().split(b"\0"):
                    line = (path / "comm").read_text().strip() + "\0"
                    found[int(path.name)] = line + (path / "cmdline").read_bytes().decode()
        return found

    def find(self, name: str) -> int | None:
        """Return the process of a name, None if it is not there."""
        if name == "launcher":
            return self.launcher.pid if self.is_alive() else None
        return next(
            (pid for pid, line in self.processes().items() if re.search(_COMMANDS[name], line)),
            None,
        )

    def listening(self) -> list[int]:
        """Return the ports of the run's block at which somebody listens."""
        if self.ports is None:
            return []
        lines = Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]
        rows = [line.split() for line in lines]
        open_ports = {int(row[1].split(":")[1], 16) for row in rows if row[3] == _LISTENS}
        return sorted(open_ports & set(self.ports))

    def leftovers(self) -> list[str]:
        """Return what is no result: temporary folders and files, half-written ones."""
        names = [path.name for path in self._temporary.iterdir()]
        hidden = [path for path in self.folder.rglob(".*") if path.parent.name != "cwd"]
        return names + [str(path.relative_to(self.folder)) for path in hidden]

    def clear(self) -> None:
        """End whatever is left."""
        while left := self.processes():
            for pid in left:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self.launcher.poll()
            time.sleep(_LOOK_S)
        self.launcher.wait()


def _await(what: str, is_so: Callable[[], bool], limit_s: float) -> None:
    limit = time.monotonic() + limit_s
    while not is_so():
        if time.monotonic() > limit:
            raise TimeoutError(f"{what} did not come about in {limit_s:g} s")
        time.sleep(_LOOK_S)


def _await_phase(run: _Run, trial: Trial) -> None:
    """Wait until the phase has begun, or the run is over."""

    def has_begun() -> bool:
        if not run.is_alive():
            return True
        if trial.phase == "start":
            return run.find(trial.victim) is not None
        if trial.phase == "whole":
            return (run.out / "summary.json").exists() or _exists(run, "summary.json")
        if trial.phase == "finishing":
            return _exists(run, "grid.parquet")
        return _has_recorded(run)

    _await(f"the phase '{trial.phase}'", has_begun, START_S)


def _has_recorded(run: _Run) -> bool:
    work = run.work()
    try:
        return work is not None and len(read_whole(work / "grid.arrows", ["t_s"])) > 0
    except (OSError, ValueError):
        return False


def _exists(run: _Run, name: str) -> bool:
    work = run.work()
    return work is not None and (work / name).exists()


def _inflict(run: _Run, trial: Trial) -> None:
    if trial.fault == "FULL DISK":
        fill(run.folder)
        return
    pid = run.find(trial.victim)
    if pid is None:
        return
    with suppress(ProcessLookupError):
        if trial.fault == "FILE LIMIT":
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (0, 0))
        elif trial.fault in _SIGNALS:
            os.kill(pid, _SIGNALS[trial.fault])
        else:
            for _ in trial.fault.split():
                os.killpg(pid, signal.SIGINT)
                # As fast as fingers are; two at the same instant would be one to the kernel.
                time.sleep(0.05)


def fill(folder: Path) -> None:
    """Leave no room on the disk that a folder is on."""
    with (folder / "filler").open("wb", buffering=0) as filler:
        for size in (1 << 20, 4096, 1):
            with suppress(OSError):
                while filler.write(bytes(size)) == size:
                    pass


def _await_end(run: _Run, trial: Trial, finding: Finding, begin_s: float) -> None:
    def is_over() -> bool:
        # The launcher's own death is no end: what it leaves must end, too.
        return not run.is_alive() and not (trial.victim == "launcher" and run.processes())

    _await("the end", is_over, PATIENCE_S)
    finding.end_s = time.monotonic() - begin_s
    finding.exit_code = run.launcher.returncode
    finding.busy = max(1.0, os.getloadavg()[0] / len(os.sched_getaffinity(0)))

    def is_clean() -> bool:
        return not (run.processes() or run.listening() or run.leftovers())

    with suppress(TimeoutError):
        _await("a clean end", is_clean, CLEAN_WITHIN_S * finding.busy)
    finding.clean_s = time.monotonic() - begin_s - finding.end_s


def _look(run: _Run, trial: Trial, finding: Finding) -> Iterator[str]:
    for what, left in (
        ("processes", [*run.processes().values()]),
        ("ports", run.listening()),
        ("files", run.leftovers()),
    ):
        if left:
            yield f"{what} are left: {left}"
    if any(line.startswith("Traceback") for line in run.said.splitlines()):
        yield f"it showed a traceback: {run.said[-600:]}"
    yield from look_at_result(run, trial, finding)
