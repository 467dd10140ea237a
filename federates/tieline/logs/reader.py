"""Reads the logs of a run: all processes in one order, some of it, as text."""

import heapq
from collections.abc import Iterable, Iterator
from pathlib import Path

from tieline.errors import InputError
from tieline.logs.record import LEVELS, Record
from tieline.units import ns_to_seconds

LOGS = "logs"
MERGED = "run.jsonl"

Key = tuple[int, str, str]


def merge(folder: Path) -> Path | None:
    """Write the logs of a run folder into `logs/run.jsonl`, and return that; None without any."""
    paths = _own_logs(folder)
    if not paths:
        return None
    target = folder / LOGS / MERGED
    part = target.with_name(f".{MERGED}.part")
    try:
        with part.open("wb") as file:
            for record in _in_order(paths):
                file.write(record.to_line() + b"\n")
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    return target


def records(folder: Path) -> Iterator[Record]:
    """Yield the records of a run in the order of `docs/logs.md`, merged by now or not.

    Raises:
        InputError: the folder has no logs.
    """
    merged = folder / LOGS / MERGED
    paths = [merged] if merged.is_file() else _own_logs(folder)
    if not paths:
        raise InputError(f"{folder} has no logs: there is no {LOGS}/*.jsonl in it")
    yield from _lines(merged) if merged.is_file() else _in_order(paths)


def chosen(
    found: Iterable[Record],
    process: str | None = None,
    level: str = LEVELS[0],
    from_s: float | None = None,
    to_s: float | None = None,
) -> Iterator[Record]:
    """Yield those of some records that were asked for.

    Args:
        found: in order.
        process: whose; None for all.
        level: the least.
        from_s: simulated time to begin with, s; what came before the first grant is then left out.
        to_s: the last simulated time, s.
    """
    levels = LEVELS[LEVELS.index(level) :]
    for record in found:
        time_s = ns_to_seconds(record.t_ns) if record.t_ns is not None else float("-inf")
        is_in = (from_s is None or time_s >= from_s) and (to_s is None or time_s <= to_s)
        if is_in and record.level in levels and process in (None, record.process):
            yield record


def shown(record: Record) -> str:
    """Return a record as text: one line, and below it a traceback if it has one."""
    time = "-" if record.t_ns is None else f"{ns_to_seconds(record.t_ns):.6f}"
    wall = record.wall.partition("T")[2].rstrip("Z")
    first, *others = (record.message or "").splitlines() or [""]
    others += str(record.fields.get("traceback", "")).splitlines()
    head = f"{time:>12} s  {wall}  {record.level:<7}  {record.process:<8}  {first}"
    return "\n".join([head, *(f"{'':>14}| {line}" for line in others)])


def processes_of(folder: Path) -> list[str]:
    """Return whose logs a run folder has."""
    return [path.stem for path in _own_logs(folder)]


def _own_logs(folder: Path) -> list[Path]:
    return [path for path in sorted((folder / LOGS).glob("*.jsonl")) if path.name != MERGED]


def _in_order(paths: Iterable[Path]) -> Iterator[Record]:
    for _, record in heapq.merge(*(_keyed(path) for path in paths), key=lambda pair: pair[0]):
        yield record


def _keyed(path: Path) -> Iterator[tuple[Key, Record]]:
    """Yield a log's records, each with its place among those of others.

    A process's own order is never changed: a record counts at least as late as the one before it.
    """
    t_ns, wall = -1, ""
    for record in _lines(path):
        t_ns = max(t_ns, -1 if record.t_ns is None else record.t_ns)
        wall = max(wall, record.wall)
        yield (t_ns, wall, path.stem), record


def _lines(path: Path) -> Iterator[Record]:
    last: Record | None = None
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            try:
                last = Record.from_line(line)
            except ValueError:
                last = _damaged(path, line, last)
            yield last


def _damaged(path: Path, line: str, last: Record | None) -> Record:
    """Return what stands for a line that was cut short, at the time of the line before it."""
    when = (last.t_ns, last.wall, last.monotonic_ns) if last else (None, "", 0)
    text = f"a damaged line: {line.rstrip()[:200]}"
    return Record(*when, "warning", path.stem, "damaged", text)
