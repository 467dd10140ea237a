"""One line of a log: when, how bad, who, what happened, in words, and with which figures."""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

LEVELS = ("debug", "info", "warning", "error")
"""From the least to the worst."""

LONGEST_TEXT = 16_000
"""Characters of one text in a line; of a longer one the beginning and the end are kept."""

LINE_BEGINS = b'{"t_ns"'
"""How the line of a record begins, so that it is told apart from whatever else a process prints."""


@dataclass(frozen=True)
class Record:
    """One line of a log.

    Attributes:
        t_ns: simulated time, ns; None before the first grant.
        wall: wall time, ISO 8601 in UTC with microseconds.
        monotonic_ns: the host's clock that nobody sets, for the order and distance of two lines.
        level: one of `LEVELS`.
        process: who wrote or printed it, or whom the launcher started under that name.
        event: one word.
        message: what a reader is told.
        fields: figures and texts by name, as JSON has them.
    """

    t_ns: int | None
    wall: str
    monotonic_ns: int
    level: str
    process: str
    event: str
    message: str
    fields: Mapping[str, Any] = field(default_factory=dict)

    def to_line(self) -> bytes:
        """Return the record as one line of JSON, without its end."""
        fields = {name: _shortened(value) for name, value in self.fields.items()}
        content = {**vars(self), "message": _shortened(self.message), "fields": fields}
        return json.dumps(content, ensure_ascii=False, default=str).encode(errors="replace")

    @classmethod
    def from_line(cls, line: bytes | str) -> "Record":
        """Return the record of a line.

        Raises:
            ValueError: it is none, or was cut short.
        """
        try:
            record = cls(**json.loads(line))
            is_sound = record.t_ns is None or record.t_ns >= 0
            is_sound = is_sound and record.level in LEVELS and record.wall.endswith("Z")
        except (ValueError, TypeError, AttributeError):
            is_sound = False
        if not is_sound:
            raise ValueError(f"no record of a log: {str(line)[:80]}")
        return record

    def of(self, process: str) -> "Record":
        """Return the record as another process's."""
        return replace(self, process=process)


def record_now(
    t_ns: int | None,
    level: str,
    process: str,
    event: str,
    message: str,
    fields: Mapping[str, Any] | None = None,
) -> Record:
    """Return a record of this instant of wall time."""
    wall = datetime.now(UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")
    return Record(t_ns, wall, time.monotonic_ns(), level, process, event, message, fields or {})


def _shortened(value: Any) -> Any:
    if not isinstance(value, str) or len(value) <= LONGEST_TEXT:
        return value
    half = LONGEST_TEXT // 2
    return f"{value[:half]}\n... ({len(value) - 2 * half} characters left out) ...\n{value[-half:]}"
