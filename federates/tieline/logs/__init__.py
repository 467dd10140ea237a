"""The logs of a run: JSON lines of each process, capped, and merged in one order."""

from tieline.logs.reader import LOGS, MERGED, chosen, merge, processes_of, records, shown
from tieline.logs.record import LEVELS, LINE_BEGINS, Record, record_now
from tieline.logs.writer import Log

__all__ = [
    "LEVELS",
    "LINE_BEGINS",
    "LOGS",
    "MERGED",
    "Log",
    "Record",
    "chosen",
    "merge",
    "processes_of",
    "record_now",
    "records",
    "shown",
]
