"""One child process of a run: in a group of its own, heard, logged, ended and accounted for."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Protocol

import tieline
from tieline.cosim.process import LAUNCHER_VARIABLE
from tieline.experiment.strays import RUN_VARIABLE
from tieline.experiment.watch import Effort
from tieline.logs import LINE_BEGINS, Log, Record
from tieline.threads import one_thread

_READ_BYTES = 65_536
_GROUP, _UTIME = 2, 11
"""Places of group and processor time among the fields after the name in /proc/PID/stat."""
_LONGEST_LINE_BYTES = 1_000_000


@dataclass(frozen=True)
class ProcessUse:
    """What one process cost: processor time, and its peak resident memory as last looked at."""

    name: str
    exit_code: int
    cpu_s: float
    peak_bytes: int


class Process(Protocol):
    """What ends and is heard: a child, or a process of another host."""

    def poll(self) -> bool:
        """Return whether it has ended."""

    def read(self) -> Iterator[dict[str, Any]]:
        """Yield what it says."""

    def terminate(self) -> None:
        """Ask it to save and end."""

    def kill(self) -> None:
        """End it."""


class Started(Protocol):
    """A process that was started, in a session of its own, with pipes on its output."""

    pid: int
    stdout: IO[bytes] | None
    stderr: IO[bytes] | None
    returncode: int | None


Start = Callable[[Sequence[str], Mapping[str, str]], Started]
"""Starts a command in an environment, or raises an OSError."""


def executed(
    command: Sequence[str], environment: Mapping[str, str], directory: Path | None = None
) -> Started:
    """Start a command as a new program, in a directory or here."""
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
        cwd=directory,
        start_new_session=True,
    )


class Child:
    """A process in its own session, whose standard output carries JSON lines.

    Args:
        name: what the run calls it.
        command: the program and its arguments.
        log: where what it logs and prints is kept.
        start: how the process comes to be.
        has_word: whether its standard output is a federate's, with words about itself.
        run: the run's folder, which marks the process and whatever it starts in turn.

    Attributes:
        exit_code: None while it runs; negative for the signal that killed it.
        reason: always None; a process of another host may have one.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        log: Log,
        start: Start = executed,
        has_word: bool = True,
        run: Path | None = None,
    ) -> None:
        self.name = name
        self.exit_code: int | None = None
        self.reason: str | None = None
        self.use: ProcessUse | None = None
        self._peak_bytes = 0
        self._has_word = has_word
        self.log = log
        try:
            self._process = start(command, child_environment(run))
        except BaseException:
            self.log.close()
            raise
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._pending = {self._process.stdout.fileno(): b"", self._process.stderr.fileno(): b""}
        self._stdout = self._process.stdout.fileno()
        for descriptor in self._pending:
            os.set_blocking(descriptor, False)

    @property
    def pid(self) -> int:
        """The process identifier, which is its group's, too."""
        return self._process.pid

    @property
    def descriptors(self) -> tuple[int, ...]:
        """The pipes that are still open, to wait for."""
        return tuple(self._pending)

    def read(self) -> Iterator[dict[str, Any]]:
        """Yield the words of federates that have come; those and all else go to the log."""
        for descriptor in tuple(self._pending):
            for line in self._lines(descriptor):
                is_stdout = descriptor == self._stdout
                said = _parsed(line) if self._has_word and is_stdout else None
                if isinstance(said, Record):
                    self.log.add(said)
                elif said is not None:
                    self.log.hear(said)
                    yield said
                else:
                    self.log.take(line, is_error=not is_stdout)

    def poll(self) -> bool:
        """Return whether the process has ended; what is left of its group ends with it."""
        if self.exit_code is not None:
            return True
        # Looked at before it is reaped: until then its group's number cannot be another's.
        if os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
            self._peak_bytes = _peak_bytes(self.pid) or self._peak_bytes
            return False
        self._signal(signal.SIGKILL)
        _, status, usage = os.wait4(self.pid, 0)
        self.exit_code = os.waitstatus_to_exitcode(status)
        self._process.returncode = self.exit_code
        cpu_s = usage.ru_utime + usage.ru_stime
        self.use = ProcessUse(self.name, self.exit_code, cpu_s, self._peak_bytes)
        return True

    def is_stopped(self) -> bool:
        """Return whether a signal such as SIGSTOP holds the process."""
        try:
            stat = Path(f"/proc/{self.pid}/stat").read_text(encoding="ascii", errors="replace")
        except OSError:
            return False
        return stat.rpartition(")")[2].split()[0] in ("T", "t")

    def effort(self) -> Effort | None:
        """Return what it has done so far; None where the kernel does not tell."""
        return None if self.exit_code is not None else effort_of(self.pid)

    def terminate(self) -> None:
        """Ask the process to save and end; one that is stopped is woken for it."""
        if not self.poll():
            self._signal(signal.SIGTERM)
            self._signal(signal.SIGCONT)

    def kill(self) -> None:
        """End the process and its group, and reap it."""
        if not self.poll():
            self._signal(signal.SIGKILL)
            os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)
            self.poll()

    def close(self) -> None:
        """Close pipes and log; the process has ended."""
        drain([self])
        for stream in (self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
        self._pending.clear()
        self.log.close()

    def _signal(self, number: signal.Signals) -> None:
        try:
            os.killpg(self.pid, number)
        except ProcessLookupError:
            # The group emptied itself meanwhile.
            return

    def _lines(self, descriptor: int) -> Iterator[bytes]:
        while (data := _read(descriptor)) is not None:
            if not data:
                rest = self._pending.pop(descriptor)
                if rest:
                    yield rest
                return
            *lines, rest = (self._pending[descriptor] + data).split(b"\n")
            if len(rest) > _LONGEST_LINE_BYTES:
                lines, rest = [*lines, rest], b""
            self._pending[descriptor] = rest
            yield from lines


def end_all(
    children: Sequence[Process],
    grace_s: float,
    is_hurried: Callable[[], bool] = lambda: False,
) -> None:
    """End every child: each may save for `grace_s` after SIGTERM, then its group is killed.

    Args:
        children: processes, ended or not.
        grace_s: wall time, s.
        is_hurried: whether they are to be killed at once.
    """
    limit = time.monotonic() + grace_s
    try:
        for child in children:
            child.terminate()
        while time.monotonic() < limit and any(not child.poll() for child in children):
            if is_hurried():
                break
            time.sleep(0.02)
            drain(children)
    finally:
        for child in children:
            child.kill()


def drain(children: Sequence[Process]) -> None:
    """Read what the children say, so that none waits for a full pipe; only logs keep it."""
    for child in children:
        for _ in child.read():
            continue


def shared_environment(before: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that every process of a run needs, given those of the launcher."""
    # The children run this very code, wherever it was imported from.
    source = str(Path(tieline.__file__).resolve().parent.parent)
    others = before.get("PYTHONPATH")
    # A guest's `python` or `helics_recorder` is this environment's, activated or not.
    programs = str(Path(sys.executable).parent)
    shared = {
        "PYTHONPATH": source if not others else f"{source}{os.pathsep}{others}",
        "PATH": f"{programs}{os.pathsep}{before.get('PATH', os.defpath)}",
        "PYTHONFAULTHANDLER": before.get("PYTHONFAULTHANDLER", "1"),
    }
    return shared | one_thread(before)


def child_environment(run: Path | None = None) -> dict[str, str]:
    """Return the environment of a process that must not outlive this one, nor a run's folder."""
    own = {LAUNCHER_VARIABLE: str(os.getpid())}
    if run is not None:
        own[RUN_VARIABLE] = str(run.resolve())
    return dict(os.environ) | shared_environment(os.environ) | own


def effort_of(group: int) -> Effort | None:
    """Return what the living processes of a group have done; None where the kernel does not tell.

    A program that another one started, such as a shell, works in its group.
    """
    efforts = [effort for path in Path("/proc").glob("[0-9]*") if (effort := _effort(path, group))]
    if not efforts:
        return None
    cpu_s = sum(effort.cpu_s for effort in efforts)
    return Effort(cpu_s, sum(effort.disk_bytes for effort in efforts))


def _effort(process: Path, group: int) -> Effort | None:
    try:
        stat = (process / "stat").read_text(encoding="ascii", errors="replace")
        fields = stat.rpartition(")")[2].split()
        if int(fields[_GROUP]) != group:
            return None
        io = (process / "io").read_text(encoding="ascii")
    except OSError:
        return None
    # Its own, in user and system mode, and that of its children that have ended.
    ticks = sum(map(int, fields[_UTIME : _UTIME + 4]))
    moved = dict(line.split(": ") for line in io.splitlines())
    disk_bytes = int(moved["read_bytes"]) + int(moved["write_bytes"])
    return Effort(ticks / os.sysconf("SC_CLK_TCK"), disk_bytes)


def _peak_bytes(pid: int) -> int:
    """Return the peak resident memory of a living process, 0 where the kernel does not tell.

    Not what wait4 says: that begins with the memory of the launcher, whose fork the child was.
    """
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0
    for line in status.splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    return 0


def _read(descriptor: int) -> bytes | None:
    try:
        return os.read(descriptor, _READ_BYTES)
    except BlockingIOError:
        return None


def _parsed(line: bytes) -> dict[str, Any] | Record | None:
    """Return a federate's word or record, None for what is neither."""
    try:
        if line.startswith(LINE_BEGINS):
            return Record.from_line(line)
        if line.startswith(b'{"federate"'):
            word: dict[str, Any] = json.loads(line)
            return word
    except ValueError:
        return None
    return None
