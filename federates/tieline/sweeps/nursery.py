"""`python -m tieline.sweeps.nursery`: imports and compiles once, then forks a process a point.

It reads JSON lines: first how to prepare (`core`, `rehearsal`), then orders with `id`, `work` and
`task`. It writes JSON lines: `ready`, then with the `id` of an order `time_s` while a point goes
on, `error` when it fails, and `exit_code` when its process has ended. It ends with its input.

It has one thread and simulates nothing but a rehearsal of two intervals, which loads the compiled
code; a point's process forks its federates in turn and watches them, so that whatever a point does
to itself stays with it.
"""

import json
import os
import select
import signal
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from tieline.cosim.local import run_local
from tieline.cosim.process import LAUNCHER_VARIABLE, die_with_launcher, exit_code_of, reason_of
from tieline.errors import TielineError
from tieline.experiment.launch import launch
from tieline.experiment.point import Task, run_task
from tieline.experiment.watch import Progress
from tieline.garbage import collecting_later
from tieline.sweeps.fork import fork, forked
from tieline.sweeps.single import own_steps, shared_steps

_REHEARSED_INTERVALS = 2
_REHEARSED_ENGINES = ("ideal", "constant", "packet", "empirical")
"""Engines that leave nothing behind in their process."""

_STDIN, _STDOUT, _STDERR = range(3)
_END_WITHIN_S = 12.0
_REPORT_EVERY_S = 0.25
_INTERRUPTED = 130
_LONGEST_ERROR = 500
"""Characters, so that a line stays below what a pipe takes as one; the manifest has it whole."""


def main() -> None:
    """Serve until standard input ends or SIGTERM comes, then end every point."""
    die_with_launcher()
    os.environ[LAUNCHER_VARIABLE] = str(os.getpid())
    # Arrow keeps a thread of its memory pool, which sees to itself when its process is forked.
    warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
    lines = _Lines()
    nursery = _Nursery()
    first = lines.read()
    if first is None:
        return
    _say({"ready": _prepare(first)})
    try:
        _serve(lines, nursery)
    finally:
        nursery.end()


def _serve(lines: "_Lines", nursery: "_Nursery") -> None:
    awake = _wake_ups()
    is_open = True
    while is_open:
        # Those that came in one piece with what was read before are already here.
        for order in lines.waiting():
            nursery.start(order)
        select.select([_STDIN, awake], [], [])
        if signal.SIGTERM in _signals(awake):
            return
        nursery.reap()
        is_open = lines.take()


class _Lines:
    """Orders from standard input, as they come."""

    def __init__(self) -> None:
        self._rest = b""
        self._whole: list[bytes] = []

    def read(self) -> dict[str, Any] | None:
        """Wait for one order; None at the end."""
        while not self._whole:
            if not self._more():
                return None
        order: dict[str, Any] = json.loads(self._whole.pop(0))
        return order

    def take(self) -> bool:
        """Take in what is there, without waiting; False at the end."""
        while select.select([_STDIN], [], [], 0)[0]:
            if not self._more():
                return False
        return True

    def waiting(self) -> list[dict[str, Any]]:
        """Return the whole orders that were taken in."""
        orders = [json.loads(line) for line in self._whole]
        self._whole.clear()
        return orders

    def _more(self) -> bool:
        data = os.read(_STDIN, 1 << 16)
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._whole += lines
        return bool(data)


class _Nursery:
    """The processes of the points under way, by their number."""

    def __init__(self) -> None:
        self._orders: dict[int, int] = {}

    def start(self, order: Mapping[str, Any]) -> None:
        """Fork the process of one point."""
        said = os.dup(_STDOUT)
        pid = fork(partial(_run_point, order), (said, _STDERR))
        os.close(said)
        self._orders[pid] = order["id"]

    def reap(self) -> None:
        """Tell of each process that has ended."""
        for pid in tuple(self._orders):
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                exit_code = os.waitstatus_to_exitcode(status)
                _say({"id": self._orders.pop(pid), "exit_code": exit_code})

    def end(self) -> None:
        """Have every point save and end, and kill what does not."""
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        for pid in self._orders:
            os.kill(pid, signal.SIGTERM)
        limit = time.monotonic() + _END_WITHIN_S
        while self._orders and time.monotonic() < limit:
            time.sleep(0.02)
            self.reap()
        for pid in self._orders:
            os.killpg(pid, signal.SIGKILL)


def _run_point(order: Mapping[str, Any]) -> None:
    """Run one point in this process, a fork; its exit code is that of its error."""
    die_with_launcher()
    task = Task(**order["task"])
    reporter = _Reporter(order["id"])
    try:
        run_task(Path(order["work"]), task, _launch, reporter.report)
    except KeyboardInterrupt:
        raise SystemExit(_INTERRUPTED) from None
    except Exception as error:
        if not isinstance(error, TielineError):
            _keep_traceback(Path(task.folder) / "logs", error)
        _say({"id": order["id"], "error": reason_of(error)[:_LONGEST_ERROR]})
        raise SystemExit(exit_code_of(error)) from None


def _keep_traceback(logs: Path, error: Exception) -> None:
    """Write beside the point's logs where an unexpected error arose; its message is told."""
    try:
        logs.mkdir(exist_ok=True)
        text = "".join(traceback.format_exception(error))
        (logs / "launcher.log").write_text(text, encoding="utf-8")
    except OSError:
        # There is no result folder, or no room in it.
        return


def _launch(folder: Path, on_progress: Callable[[Progress], None]) -> Any:
    return launch(folder, on_progress, start=forked)


class _Reporter:
    """Tells the simulated time of a point, now and then."""

    def __init__(self, order: int) -> None:
        self._order = order
        self._next_s = 0.0

    def report(self, time_s: float) -> None:
        """Tell it, if it was not just told."""
        if time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + _REPORT_EVERY_S
            _say({"id": self._order, "time_s": time_s})


def _prepare(order: Mapping[str, Any]) -> str:
    """Import and rehearse; return what came of the rehearsal."""
    with collecting_later():
        for step in (*shared_steps(), *own_steps(order["core"])):
            step()
    run = order["rehearsal"]
    if run is None or run["network"]["engine"] not in _REHEARSED_ENGINES:
        return "not rehearsed"
    if run["grid"]["pss"]["file"] is not None:
        return "not rehearsed: a model from outside must stay in its point's process"
    try:
        with tempfile.TemporaryDirectory() as folder:
            _rehearse(run, Path(folder))
    except Exception as error:
        # The point itself meets the same error, and tells it with its place.
        return f"rehearsal failed: {reason_of(error)[:_LONGEST_ERROR]}"
    return "rehearsed"


def _rehearse(run: dict[str, Any], folder: Path) -> None:
    from tieline.cosim.interfaces import Clock
    from tieline.grid.federate import open_participant as open_grid
    from tieline.network.federate import open_participant as open_network

    clock = {**run["clock"], "intervals": _REHEARSED_INTERVALS}
    short = {**run, "clock": clock}
    run_local(open_grid(short, folder), open_network(short, folder), Clock(**clock))


def _wake_ups() -> int:
    """Return a descriptor that can be read when a child has ended or SIGTERM came."""
    reader, writer = os.pipe()
    for descriptor in (reader, writer):
        os.set_blocking(descriptor, False)
    for number in (signal.SIGCHLD, signal.SIGTERM):
        signal.signal(number, lambda *_: None)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    return reader


def _signals(awake: int) -> bytes:
    try:
        return os.read(awake, 4096)
    except BlockingIOError:
        return b""


def _say(line: Mapping[str, Any]) -> None:
    # One write, so that the lines of several processes never mix.
    os.write(_STDOUT, json.dumps(line).encode() + b"\n")


if __name__ == "__main__":
    main()
