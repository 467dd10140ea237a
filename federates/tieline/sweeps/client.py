"""The other side of the nursery: hands tasks to it from any thread, and hears how they go."""

import json
import queue
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tieline.errors import TielineError
from tieline.experiment.point import Task, mark_lost, work_folder
from tieline.experiment.supervise import child_environment

_END_WITHIN_S = 15.0


@dataclass(frozen=True)
class Reached:
    """A task has reached a simulated time, s."""

    tag: int
    time_s: float


@dataclass(frozen=True)
class Done:
    """A task has ended.

    Attributes:
        error: why it failed, or None.
        is_orphan: whether the nursery died around it, which is no fault of its own.
    """

    tag: int
    error: TielineError | None = None
    is_orphan: bool = False


Events = queue.SimpleQueue[Reached | Done]


@dataclass
class _Order:
    tag: int
    task: Task
    work: Path
    events: Events
    said: list[str] = field(default_factory=list)


class Nursery:
    """A process that imports and compiles once, and forks a process for each task.

    Args:
        core: of the federations to come.
        rehearsal: content of a run file of which two intervals are tried first; None for none.
    """

    def __init__(self, core: str, rehearsal: Mapping[str, Any] | None) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tieline.sweeps.nursery"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=child_environment(),
            # Ctrl-C is for whoever leads; it ends the nursery, which lets its points save.
            start_new_session=True,
        )
        self._orders: dict[int, _Order] = {}
        self._count = 0
        self._is_over = False
        self._lock = threading.Lock()
        self._tell({"core": core, "rehearsal": rehearsal})
        self._reader = threading.Thread(target=self._read, name="nursery", daemon=True)
        self._reader.start()

    @property
    def is_over(self) -> bool:
        """Whether it has ended, by itself or not."""
        return self._is_over

    def submit(self, task: Task, events: Events, tag: int = 0) -> None:
        """Have a task run; what becomes of it is put into `events` under `tag`."""
        with self._lock:
            order = _Order(tag, task, work_folder(task), events)
            if self._is_over:
                self._orphan(order)
                return
            # What a nursery that was killed has left of an earlier attempt.
            shutil.rmtree(order.work, ignore_errors=True)
            self._count += 1
            self._orders[self._count] = order
            line = {"id": self._count, "work": str(order.work), "task": task.to_json()}
            self._tell(line)

    def close(self) -> None:
        """End every point that is under way, and the nursery."""
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(_END_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    def _tell(self, line: Mapping[str, Any]) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(line).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            # Its end is noticed by the reader, which tells of every order.
            return

    def _read(self) -> None:
        assert self._process.stdout is not None
        try:
            for text in self._process.stdout:
                # Whatever a library prints there is none of the protocol's.
                if text.startswith(b'{"id"'):
                    self._hear(json.loads(text))
        finally:
            # Whoever waits for an order must hear of it, whatever went wrong here.
            with self._lock:
                self._is_over = True
                for order in self._orders.values():
                    self._orphan(order)
                self._orders.clear()

    def _hear(self, line: Mapping[str, Any]) -> None:
        order = self._orders[line["id"]]
        if "time_s" in line:
            order.events.put(Reached(order.tag, line["time_s"]))
        elif "error" in line:
            order.said.append(line["error"])
        else:
            # First, since an order that is no longer listed would be waited for for ever.
            error = _error(order, line["exit_code"])
            with self._lock:
                del self._orders[line["id"]]
            order.events.put(Done(order.tag, error))

    @staticmethod
    def _orphan(order: _Order) -> None:
        error = TielineError("the process that starts the points was killed")
        order.events.put(Done(order.tag, error, is_orphan=True))


def _error(order: _Order, exit_code: int) -> TielineError | None:
    """Return the error of a point whose process has ended; None if it ended well."""
    if exit_code == 0:
        return None
    if order.said:
        error = TielineError(order.said[-1])
    elif exit_code < 0:
        error = TielineError(f"its process was killed by {signal.Signals(-exit_code).name}")
    else:
        error = TielineError(f"its process ended with exit code {exit_code}")
    error.exit_code = exit_code if exit_code > 0 else TielineError.exit_code
    if order.work.exists():
        try:
            mark_lost(order.work, order.task, str(error))
        except Exception as second:
            # Whoever waits for this point must hear of it all the same.
            error.add_note(f"what it wrote could not be made readable: {second}")
    return error
