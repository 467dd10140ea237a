"""What a federate's process logs of itself: records on its standard output, for its launcher."""

import logging
import os
import sys
import traceback
from collections.abc import Sequence

from tieline.cosim.process import LAUNCHER_VARIABLE
from tieline.cosim.status import Status, write_line
from tieline.logs import record_now

_LEVELS = ((logging.ERROR, "error"), (logging.WARNING, "warning"), (logging.INFO, "info"))

_LOGGER = logging.getLogger("tieline.cosim")


class Journal(logging.Handler):
    """Writes what is logged in this process, Python's warnings included, as records.

    A record has the time of the last grant. `extra={"event": ..., "fields": {...}}` of a logging
    call give its word and its figures.

    Args:
        process: what the run calls this process.
        statuses: of the federates in it.
        descriptor: where the lines go.
    """

    def __init__(self, process: str, statuses: Sequence[Status], descriptor: int) -> None:
        super().__init__(logging.INFO)
        self._process = process
        self._statuses = tuple(statuses)
        self._descriptor = descriptor

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line."""
        fields = {"logger": record.name, **getattr(record, "fields", {})}
        if record.exc_info and record.exc_info[1] is not None:
            fields["error"] = type(record.exc_info[1]).__name__
            fields["traceback"] = "".join(traceback.format_exception(record.exc_info[1]))
        level = next((name for least, name in _LEVELS if record.levelno >= least), "debug")
        granted_ns = max(status.granted_ns for status in self._statuses)
        content = record_now(
            granted_ns if granted_ns >= 0 else None,
            level,
            self._process,
            getattr(record, "event", "log"),
            record.getMessage(),
            fields,
        )
        self._descriptor = write_line(self._descriptor, content.to_line())


def keep_journal(process: str, statuses: Sequence[Status], descriptor: int) -> None:
    """Have all that is logged in this process written by a `Journal` from now on."""
    logging.getLogger().addHandler(Journal(process, statuses, descriptor))
    logging.captureWarnings(True)


def log_failure(name: str, error: BaseException) -> None:
    """Log why a federate fails, with its traceback; print that where no launcher listens."""
    text = f"{name}: {type(error).__name__}: {error}"
    extra = {"event": "failed", "fields": {"federate": name}}
    _LOGGER.error(text, exc_info=error, extra=extra)
    if LAUNCHER_VARIABLE not in os.environ:
        traceback.print_exception(error, file=sys.stderr)
