"""Finds the last run of a folder, and tells what became of it."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tieline.doctor.causes import LAUNCHER_KILLED, Cause, cause_of
from tieline.errors import InputError
from tieline.experiment.point import UNDER_WAY
from tieline.experiment.results import MANIFEST, POINTS, is_result, read_manifest
from tieline.logs import Record, records
from tieline.tables import read_table, salvage
from tieline.units import ns_to_seconds

RESULTS = "results"
_PARTIAL = re.compile(r"\.partial-(?:.*-)?(?P<pid>\d+)$")
_MOST_LINES = 8


@dataclass(frozen=True)
class Story:
    """What became of a run.

    Attributes:
        folder: its result folder.
        status: `complete`, `incomplete` or `under way`.
        name: of the experiment, with the point's label in a sweep.
        simulated_s: how long it was to be, s.
        reached_s: last time granted to any federate, s; None for none.
        culprit: the process at fault; None where there is none, or it is not known.
        reason: what happened to it.
        wall: wall time of the fault, ISO 8601.
        others: what each of the other federates was doing, in words.
        lines: the culprit's last lines.
        cause: what usually stands behind it; None for a run that is whole.
        tables: each readable table with the time that its rows reach to, None where they have none.
        made: tables that were just made of what a killed run had streamed to disk.
    """

    folder: Path
    status: str
    name: str
    simulated_s: float
    reached_s: float | None = None
    culprit: str | None = None
    reason: str = ""
    wall: str | None = None
    others: Mapping[str, str] = field(default_factory=dict)
    lines: Sequence[str] = ()
    cause: Cause | None = None
    tables: Mapping[str, float | None] = field(default_factory=dict)
    made: Sequence[str] = ()


def last_result(place: Path) -> Path:
    """Return the newest result in a folder or in its `results/`, runs under way included.

    Raises:
        InputError: there is none.
    """
    found = [path for path in _children(place) if is_result(path)]
    if not found:
        raise InputError(f"no result in {place.resolve()} or its {RESULTS}/: give the folder")
    return max(found, key=lambda path: (path / MANIFEST).stat().st_mtime)


def story_of(folder: Path) -> Story:
    """Return what became of a run, or of the last point of a sweep that failed.

    What a killed run has streamed to disk is made readable first.

    Raises:
        InputError: the folder is no result.
    """
    manifest = read_manifest(folder)
    if manifest["kind"] == "sweep":
        point = _failed_point(folder)
        if point is not None:
            return story_of(point)
        return Story(folder, str(manifest["status"]), str(manifest["name"]), 0.0)
    name = " ".join(filter(None, [manifest["name"], manifest["label"]]))
    simulated_s = float(manifest["config"]["grid"]["duration"])
    if manifest["status"] == "complete":
        reached = _reached_s(manifest.get("granted_ns", {}))
        return Story(folder, "complete", name, simulated_s, reached, tables=_tables(folder))
    if manifest["reason"] == UNDER_WAY and _is_alive(folder):
        return Story(folder, "under way", name, simulated_s)
    return _failure(folder, manifest, name, simulated_s)


def _failure(folder: Path, manifest: Mapping[str, Any], name: str, simulated_s: float) -> Story:
    found = _log(folder)
    # What happened first counts: the fault, or else what ended the launch.
    told = [record for record in found if record.event in ("fault", "failed")]
    told.sort(key=lambda record: record.event != "fault")
    fault = next((r for r in told if r.process.startswith("launcher")), None)
    culprit, reason = _blamed(fault, str(manifest["reason"]))
    is_killed = fault is None and manifest["reason"] == UNDER_WAY
    lines = _last_lines(found, culprit)
    errors = [str(record.fields.get("error", "")) for record in found if record.level == "error"]
    cause = (
        LAUNCHER_KILLED
        if is_killed
        else cause_of(f"{culprit}: {reason}", *errors, "\n".join(lines))
    )
    made = [path.name for path in salvage(folder)]
    return Story(
        folder,
        "incomplete",
        name,
        simulated_s,
        _reached_s(_granted(found) | dict(manifest.get("granted_ns", {}))),
        culprit,
        "its launcher is gone, and it did not end by itself" if is_killed else reason,
        fault.wall if fault else (found[-1].wall if found else None),
        _others(found, fault, culprit),
        lines,
        cause,
        _tables(folder),
        made,
    )


def _children(place: Path) -> Iterator[Path]:
    for parent in (place, place / RESULTS):
        if parent.is_dir():
            yield from (path for path in parent.iterdir() if path.is_dir())


def _failed_point(folder: Path) -> Path | None:
    points = folder / POINTS
    found = [path for path in points.iterdir() if is_result(path)] if points.is_dir() else []
    failed = [path for path in found if read_manifest(path)["status"] != "complete"]
    return max(failed, key=lambda path: (path / MANIFEST).stat().st_mtime, default=None)


def _is_alive(folder: Path) -> bool:
    """Return whether the launcher that works in a folder is still there."""
    found = _PARTIAL.search(folder.resolve().name)
    if found is None:
        return False
    try:
        os.kill(int(found["pid"]), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _log(folder: Path) -> list[Record]:
    try:
        return list(records(folder))
    except InputError:
        # A result of an earlier release: the manifest tells what is known.
        return []


def _blamed(fault: Record | None, reason: str) -> tuple[str | None, str]:
    if fault is not None and fault.event == "fault":
        return str(fault.fields["name"]), str(fault.fields["reason"])
    first = reason.splitlines()[0] if reason else ""
    name, found, rest = first.partition(": ")
    if found and re.fullmatch(r"[a-z][\w.-]*", name):
        return name, rest
    return None, first


def _last_lines(found: Sequence[Record], culprit: str | None) -> list[str]:
    own = [record for record in found if record.process in (culprit, "together")]
    said = [record for record in own if record.event not in ("state", "grant")]
    lines: list[str] = []
    for record in said[-_MOST_LINES:]:
        lines += str(record.fields.get("traceback") or record.message).rstrip().splitlines()
    return lines[-_MOST_LINES:]


def _granted(found: Sequence[Record]) -> dict[str, int]:
    """Return the last grant that the log tells of each process."""
    return {r.process: r.t_ns for r in found if r.t_ns is not None}


def _reached_s(granted_ns: Mapping[str, int]) -> float | None:
    reached = [value for value in granted_ns.values() if value >= 0]
    return ns_to_seconds(max(reached)) if reached else None


def _others(found: Sequence[Record], fault: Record | None, culprit: str | None) -> dict[str, str]:
    """Return what each of the others was doing when the fault was seen, in words."""
    words = {r.fields["federate"]: r.fields for r in found if r.event in ("state", "grant")}
    if fault is not None and fault.fields.get("words"):
        words = dict(fault.fields["words"])
    return {name: _doing(word) for name, word in words.items() if name != culprit}


def _doing(word: Mapping[str, Any]) -> str:
    granted_ns = int(word.get("granted_ns", -1))
    parts = [str(word.get("state", "unknown"))]
    if granted_ns >= 0:
        parts.append(f"last granted {ns_to_seconds(granted_ns):.6f} s")
    if word.get("waits"):
        parts.append("waiting for a grant")
    return ", ".join(parts)


def _tables(folder: Path) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for path in sorted(folder.glob("*.parquet")):
        try:
            times = read_table(path, ["t_s"])["t_s"]
        except (KeyError, ValueError):
            found[path.name] = None
            continue
        found[path.name] = float(times.iloc[-1]) if len(times) else None
    return found
