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
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from tieline.tables import read_whole

END_WITHIN_S = 10.0
CLEAN_WITHIN_S = 2.0
"""Both where a core is free: on a busy machine, as many times longer as there are processes that
want to run on each core."""
PATIENCE_S = 200.0
START_S = 120.0
BLOCK = 100
GRANTED = "last granted"
VISITOR = "visitor"

_MARK = "TIELINE_TRIAL"
_LOOK_S = 0.02
_LISTENS = "0A"
_COMMANDS = {
    "broker": r"tieline\.cosim\.broker",
    "grid": r"tieline\.grid\b|dummy\.py\0grid\0",
    "network": r"tieline\.network\b|dummy\.py\0network\0",
    "together": r"tieline\.cosim\.together|dummy\.py\0together\0",
    "keeper": r"strays\.py",
    VISITOR: r"guest\.py",
}
_SIGNALS = {"KILL": signal.SIGKILL, "STOP": signal.SIGSTOP, "TERM": signal.SIGTERM}

GUEST = """
import helics, json, subprocess, sys
# A child that left its parent's group and hears no SIGTERM: what a guest's own tools may be like.
deaf = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(3600)"
subprocess.Popen([sys.executable, "-S", "-c", deaf], start_new_session=True)
config = json.load(open(sys.argv[1]))
federate = helics.helicsCreateMessageFederateFromConfig(sys.argv[1])
helics.helicsFederateRegisterGlobalEndpoint(federate, "visitor/any")
helics.helicsFederateEnterExecutingMode(federate)
for k in range(config["tieline"]["intervals"]):
    helics.helicsFederateRequestTime(federate, k / 60 + 3e-6)
helics.helicsFederateDisconnect(federate)
"""


@dataclass(frozen=True)
class Trial:
    """One harm.

    Attributes:
        fault: KILL, STOP, TERM, INT, INT INT, FILE LIMIT (no file of the process may grow) or
            FULL DISK.
        victim: launcher, keeper, broker, grid, network, together or visitor.
        phase: start (the victim is there), running (the grid has recorded), finishing (the grid
            has written its table) or whole (the result has its place, or nearly).
        core: of the federation.
        after_s: wall time from the phase's begin to the fault.
        has_older: whether a whole result is at the target already.
    """

    fault: str
    victim: str
    phase: str
    core: str
    after_s: float
    has_older: bool = False

    @property
    def kind(self) -> str:
        """What it is counted under."""
        return f"{self.fault} {self.victim}" if self.fault != "FULL DISK" else self.fault


@dataclass
class Finding:
    """What came of a trial."""

    trial: Trial
    end_s: float = 0.0
    clean_s: float = 0.0
    exit_code: int | None = None
    status: str = ""
    reason: str = ""
    last_valid_s: float | None = None
    busy: float = 1.0
    broken: list[str] = field(default_factory=list)


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
        manifest = _read(self.out / "manifest.json")
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
        """Return every living process of the run, with its command line, words apart by NUL."""
        found = {}
        mark = self._mark.encode()
        for path in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                if mark in (path / "environ").read_bytes().split(b"\0"):
                    found[int(path.name)] = (path / "cmdline").read_bytes().decode()
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
        if run.is_alive():
            # All that is left is to draw, which the fault could not hinder any more.
            return trial.victim != "launcher" and run.is_whole()
        return not (trial.victim == "launcher" and run.processes())

    _await("the end", is_over, PATIENCE_S)
    finding.end_s = time.monotonic() - begin_s
    finding.exit_code = run.launcher.returncode
    finding.busy = max(1.0, os.getloadavg()[0] / len(os.sched_getaffinity(0)))
    if run.is_alive():
        run.clear()

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
    yield from _look_at_result(run, trial, finding)


def _look_at_result(run: _Run, trial: Trial, finding: Finding) -> Iterator[str]:
    folder = run.folder / "out-incomplete"
    if trial.has_older and not (folder / "manifest.json").exists():
        folder = run.out
    elif trial.has_older:
        if _read(run.out / "manifest.json").get("label") != "older":
            yield "the older result is gone"
        yield from whole(run.out, trial)
    else:
        folder = run.out
    manifest = _read(folder / "manifest.json")
    finding.status = manifest.get("status", "none")
    finding.reason = manifest.get("reason") or ""
    finding.last_valid_s = manifest.get("last_valid_s")
    if finding.status == "complete":
        # The fault came when all was done, or hit nobody who had still something to do.
        is_older = manifest.get("label") == "older"
        if is_older and finding.exit_code == 0:
            yield "it said that all went well, and the older result is still there"
        yield from whole(folder, trial)
        return
    if finding.exit_code == 0:
        yield "the exit code is 0, and the result is not complete"
    yield from _words(run, trial, finding, manifest)
    yield from _incomplete(folder, trial, manifest)


def _words(run: _Run, trial: Trial, finding: Finding, manifest: Any) -> Iterator[str]:
    """Yield what is wrong with what was said of a run that is not complete."""
    if not manifest:
        if trial.phase != "start":
            yield "there is no result folder"
        return
    if trial.fault.startswith("INT") or (trial.victim, trial.fault) == ("launcher", "TERM"):
        if "interrupted" not in finding.reason:
            yield f"the reason is not the interrupt: {finding.reason}"
        return
    names = {"together": ("grid", "network", "together")}.get(trial.victim, (trial.victim,))
    if trial.fault == "FULL DISK":
        names = ("grid", "network", "launcher", "together")
    if not finding.reason.startswith(names):
        yield f"{' or '.join(names)} is not named: {finding.reason}"
    if trial.phase == "running" and GRANTED not in finding.reason:
        yield f"the last granted time is not told: {finding.reason}"
    first = finding.reason.splitlines()[0] if finding.reason else "-"
    if first not in run.said:
        yield f"the user was not told '{first}': {run.said[-600:]}"


def whole(folder: Path, trial: Trial) -> Iterator[str]:
    """Yield what a complete result lacks."""
    manifest = _read(folder / "manifest.json")
    if manifest.get("status") != "complete":
        yield f"{folder.name} is not complete"
    for name in ["summary.json", "run.json", *manifest.get("tables", ())]:
        if not (folder / name).is_file():
            yield f"{name} is missing in a complete result"
    yield from unreadable(folder)


def _incomplete(folder: Path, trial: Trial, manifest: Any) -> Iterator[str]:
    if manifest and "last_valid_s" not in manifest:
        yield "the manifest does not tell the last valid time"
    yield from unreadable(folder)
    streams = [path.name for path in folder.glob("*.arrows")]
    if streams and trial.fault != "FULL DISK":
        yield f"streams are left: {streams}"
    until_s = manifest.get("last_valid_s")
    grid = folder / "grid.parquet"
    if until_s is not None and grid.exists():
        t_s = pq.read_table(grid, columns=["t_s"]).column("t_s").to_pylist()
        if not t_s or t_s[-1] < until_s or any(b <= a for a, b in pairwise(t_s)):
            yield f"grid.parquet ends at {t_s[-1:]} s, the manifest says {until_s} s"
    if trial.phase == "running" and until_s is None and trial.victim != "together":
        yield "nothing is valid, though the grid had recorded"


def unreadable(folder: Path) -> Iterator[str]:
    """Yield the tables that cannot be read, in words."""
    for path in folder.rglob("*.parquet"):
        try:
            pq.read_table(path)
        except (OSError, ValueError) as error:
            yield f"{path.name} cannot be read: {error}"


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}


def write_guest(folder: Path) -> str:
    """Write the guest into a folder and return what an experiment says to have it."""
    (folder / "guest.py").write_text(GUEST)
    command = f"{sys.executable} guest.py {{config}}"
    return f"  guests: [{{name: {VISITOR}, command: '{command}'}}]\n"
