"""The log of one process: a file of records that stops growing, and its last lines."""

import collections
import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tieline.logs.record import Record, record_now

HEAD_BYTES = 1_000_000
"""How far a log grows while its process runs."""

TAIL_BYTES = 200_000
"""Of what comes after that, so much of the end is kept, and written when the process has ended."""

_TAIL_LINES = 8
_GRANT_EVERY_S = 5.0

_HELICS = re.compile(r"^\[[-\d]+ [:.\d]+\] \[\w+\] \[(?P<level>\w+)\] ?(?P<text>.*)$", re.DOTALL)
_HELICS_LEVELS = {"warning": "warning", "error": "error", "critical": "error", "debug": "debug"}
_WORST = re.compile(
    r"Traceback \(most recent|Fatal Python error|[Ss]egmentation fault|\bterminate "
)


def _no_time() -> int | None:
    return None


class Log:
    """What one process says of itself and prints, as records.

    A log keeps the first megabyte, says so when it is full, and ends with the last lines. A file
    that cannot be written any more, as on a full disk, costs the lines and not the run.

    Args:
        path: the file to make.
        process: whose log it is.
        now_ns: tells the simulated time that the run has reached, None before the first grant.
        head_bytes: how far the file grows while the process runs.
        tail_bytes: how much of the end is kept beyond that.

    Attributes:
        tail: the last lines that the process printed, as they are shown when it fails.
    """

    def __init__(
        self,
        path: Path,
        process: str,
        now_ns: Callable[[], int | None] = _no_time,
        head_bytes: int = HEAD_BYTES,
        tail_bytes: int = TAIL_BYTES,
    ) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.process = process
        self.tail: collections.deque[str] = collections.deque(maxlen=_TAIL_LINES)
        # Unbuffered, so that no line is lost with its writer and none fails only when closed.
        self._file = path.open("wb", buffering=0)
        self._now_ns = now_ns
        self._left_bytes = head_bytes
        self._ring = _Ring(tail_bytes)
        self._states: dict[str, Any] = {}
        self._grants: dict[str, tuple[float, int]] = {}
        self._t_ns: int | None = None

    def note(self, level: str, event: str, message: str, **fields: Any) -> None:
        """Add a record of this instant."""
        self.add(record_now(self._now_ns(), level, self.process, event, message, fields))

    def add(self, record: Record) -> None:
        """Add a record; one that is an error or a warning is shown among the last lines, too."""
        if record.level in ("warning", "error"):
            shown = record.fields.get("traceback") or record.message
            self.tail.extend(str(shown).rstrip().splitlines()[-_TAIL_LINES:])
        self._keep(record)

    def take(self, line: bytes, is_error: bool) -> None:
        """Add a line that the process printed, on its standard error or its standard output."""
        text = line.decode(errors="replace")
        self.tail.append(text)
        found = _HELICS.match(text)
        if found is not None:
            level = _HELICS_LEVELS.get(found["level"], "info")
            event, text = "helics", found["text"]
        else:
            level, event = _level_of(text, is_error), "stderr" if is_error else "stdout"
        self._keep(record_now(self._now_ns(), level, self.process, event, text))

    def hear(self, word: Mapping[str, Any]) -> None:
        """Add what a word of a federate tells that is new: a state, and a grant now and then."""
        federate, state = str(word.get("federate")), word.get("state")
        granted_ns = int(word.get("granted_ns", -1))
        if state != self._states.get(federate):
            self._states[federate] = state
            is_failed = state == "failed"
            text = f"{federate} has failed: {word.get('reason')}"
            text = text if is_failed else f"{federate} is {state}"
            level = "error" if is_failed and word.get("fault") == "own" else "info"
            self._tell(word, level, "state", text)
            self._grants[federate] = time.monotonic(), granted_ns
            return
        then_s, before_ns = self._grants.get(federate, (0.0, -1))
        if granted_ns != before_ns and time.monotonic() - then_s >= _GRANT_EVERY_S:
            self._grants[federate] = time.monotonic(), granted_ns
            self._tell(word, "info", "grant", f"interval {word.get('k')} was granted")

    def close(self) -> None:
        """Write the last lines and close the file; again does nothing."""
        if self._file.closed:
            return
        if self._ring.dropped:
            text = f"{self._ring.dropped} lines were left out here: the log was full"
            self._write(self._remark("left_out", text))
        for line in self._ring.lines:
            self._write(line)
        self._file.close()

    def _tell(self, word: Mapping[str, Any], level: str, event: str, text: str) -> None:
        granted_ns = int(word.get("granted_ns", -1))
        t_ns = granted_ns if granted_ns >= 0 else None
        names = ("federate", "state", "k", "granted_ns", "waits", "cpu_s", "fault", "exit_code")
        fields = {name: word[name] for name in names if name in word}
        self._keep(record_now(t_ns, level, self.process, event, text, fields))

    def _keep(self, record: Record) -> None:
        line = record.to_line()
        self._t_ns = record.t_ns
        if self._left_bytes <= 0:
            self._ring.add(line)
            return
        self._left_bytes -= len(line) + 1
        self._write(line)
        if self._left_bytes <= 0:
            text = "the log is full: of what comes now only the last lines are kept"
            self._write(self._remark("full", text))

    def _remark(self, event: str, text: str) -> bytes:
        return record_now(self._t_ns, "warning", self.process, event, text).to_line()

    def _write(self, line: bytes) -> None:
        try:
            self._file.write(line + b"\n")
        except OSError as error:
            self._left_bytes = 0
            self.tail.append(f"(the log cannot be written: {error.strerror})")


class _Ring:
    """The last lines that fit into some memory."""

    def __init__(self, most_bytes: int) -> None:
        self.lines: collections.deque[bytes] = collections.deque()
        self.dropped = 0
        self._most_bytes = most_bytes
        self._bytes = 0

    def add(self, line: bytes) -> None:
        self.lines.append(line)
        self._bytes += len(line) + 1
        while self._bytes > self._most_bytes and self.lines:
            self._bytes -= len(self.lines.popleft()) + 1
            self.dropped += 1


def _level_of(text: str, is_error: bool) -> str:
    if not is_error:
        return "info"
    return "error" if _WORST.search(text) else "warning"
