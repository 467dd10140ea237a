"""Messages from federates that have no business with an endpoint: dropped, counted, warned of."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

WARNINGS = 5
"""Messages of which each endpoint's log tells one by one; of the others it tells the number."""

_SHOWN_BYTES = 16
_SHOWN_NAME = 60
_MOST_SOURCES = 20
_OTHERS = "others"
_SUFFIX = ".strangers.json"

Counts = dict[str, dict[str, int]]
"""Dropped messages, by endpoint and by who sent them."""


class Strangers:
    """Counts what is dropped at the endpoints of one federate, in memory that does not grow.

    Args:
        federate: whose endpoints they are.
        say: takes each line for the log; by default standard error.

    Attributes:
        counts: dropped messages by endpoint and source; beyond 20 sources of an endpoint, the
            others together.
    """

    def __init__(self, federate: str, say: Callable[[str], None] | None = None) -> None:
        self.counts: Counts = {}
        self._federate = federate
        self._say = say or _to_the_log

    def drop(self, endpoint: str, source: str, data: bytes, why: str) -> None:
        """Count one message and, if it is among the first at its endpoint, say what it was."""
        of_endpoint = self.counts.setdefault(endpoint, {})
        before = sum(of_endpoint.values())
        name = source[:_SHOWN_NAME]
        if name not in of_endpoint and len(of_endpoint) >= _MOST_SOURCES:
            name = _OTHERS
        of_endpoint[name] = of_endpoint.get(name, 0) + 1
        if before < WARNINGS:
            begins = data[:_SHOWN_BYTES]
            self._say(
                f"warning: {endpoint} dropped a message of {source[:_SHOWN_NAME]!r}: {why}; "
                f"{len(data)} bytes, which begin {begins!r}"
            )
        elif before == WARNINGS:
            self._say(f"warning: {endpoint} drops more of the kind, which are only counted")

    def save(self, folder: Path) -> None:
        """Leave the counts, if there are any, beside the federate's tables and in its log."""
        if not self.counts:
            return
        for endpoint, sources in self.counts.items():
            told = ", ".join(f"{count} of {source!r}" for source, count in sources.items())
            self._say(f"warning: {endpoint} has dropped {told}")
        path = folder / f"{self._federate}{_SUFFIX}"
        part = path.with_suffix(".part")
        part.write_text(json.dumps(self.counts, indent=2) + "\n", encoding="utf-8")
        part.replace(path)


def dropped_messages(folder: Path) -> Counts:
    """Return what the federates of a run folder have dropped, by endpoint and source."""
    counts: Counts = {}
    for path in sorted(folder.glob(f"*{_SUFFIX}")):
        counts |= json.loads(path.read_text(encoding="utf-8"))
    return counts


def _to_the_log(line: str) -> None:
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()
