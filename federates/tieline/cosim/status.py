"""What a federate says about itself while it runs: JSON lines, at each change and now and then."""

import json
import os
import threading
import time
from collections.abc import Iterable
from typing import Any, Literal

State = Literal["opening", "joining", "running", "finishing", "finished", "failed"]
Fault = Literal["own", "other"]

_PERIOD_S = 0.25

_SPEAKING = threading.Lock()
"""Held for a line: the kernel keeps the lines of several threads apart up to 4 kB only."""


def write_line(descriptor: int, line: bytes) -> int:
    """Write one line and return the descriptor for the next; a reader that is gone ends nothing."""
    with _SPEAKING:
        data = memoryview(line + b"\n")
        try:
            while data:
                data = data[os.write(descriptor, data) :]
        except BrokenPipeError:
            return os.open(os.devnull, os.O_WRONLY)
    return descriptor


class Status:
    """The state of one federate, written as JSON lines to a file descriptor.

    A line holds `federate`, `state`, `k` (interval of the last grant, -1 before the first),
    `granted_ns` (-1 before the first), `waits` (for a grant), `cpu_s` (of the process) and, once
    failed, `reason`, `exit_code` and `fault`: `own`, or `other` if the federation ended around it.
    """

    def __init__(self, federate: str, descriptor: int) -> None:
        self.federate = federate
        self.state: State = "opening"
        self._descriptor = descriptor
        self._began_s = time.monotonic()
        self._k = -1
        self._granted_ns = -1
        self._waits = False
        self._failure: dict[str, str | int] = {}

    @property
    def granted_ns(self) -> int:
        """The last grant, ns; -1 before the first."""
        return self._granted_ns

    @property
    def wall_s(self) -> float:
        """Wall time since this was made, s."""
        return time.monotonic() - self._began_s

    def enter(self, state: State) -> None:
        """Change the state and say so at once."""
        self.state = state
        self.write()

    def wait(self) -> None:
        """Note that a grant is waited for; the next line tells it."""
        self._waits = True

    def grant(self, k: int, granted_ns: int) -> None:
        """Note a grant; the next line tells it, and the first is told at once."""
        is_first = self._granted_ns < 0
        self._k, self._granted_ns, self._waits = k, granted_ns, False
        if is_first:
            self.write()

    def fail(self, reason: str, fault: Fault, exit_code: int) -> None:
        """Enter `failed`; only the first reason counts."""
        if not self._failure:
            self._failure = {"reason": reason, "fault": fault, "exit_code": exit_code}
            self.enter("failed")

    def line(self) -> dict[str, Any]:
        """Return what is written."""
        return {
            "federate": self.federate,
            "state": self.state,
            "k": self._k,
            "granted_ns": self._granted_ns,
            "waits": self._waits,
            "cpu_s": round(time.process_time(), 3),
            **self._failure,
        }

    def write(self) -> None:
        """Write one line; a reader that is gone is no reason to stop here."""
        self._descriptor = write_line(self._descriptor, json.dumps(self.line()).encode())


class Heartbeat:
    """A thread that has every status written each quarter of a second of wall time."""

    def __init__(self, statuses: Iterable[Status]) -> None:
        self._statuses = tuple(statuses)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)

    def __enter__(self) -> "Heartbeat":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _beat(self) -> None:
        while not self._ended.wait(_PERIOD_S):
            for status in self._statuses:
                if status.state not in ("finished", "failed"):
                    status.write()
