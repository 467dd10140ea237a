"""Takes up what a killed launcher has left: readable, marked for what it is, in its place.

`python -m tieline.experiment.rescue WORK PLACE GRANTED` is what a keeper becomes.
"""

import json
import os
import re
import shutil
import socket
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.experiment.folder import (
    MANIFEST,
    OLDER,
    UNDER_WAY,
    clear,
    held,
    is_result,
    place_of_incomplete,
    put_in_place,
    read_manifest,
    write_json,
)
from tieline.experiment.strays import end_strays

LAUNCHER = "launcher"

_WORK = re.compile(r"\.(?P<name>.+)\.partial-(?:(?P<host>.+)-)?(?P<pid>\d+)(?P<older>\.older)?")


def take_up(parent: Path) -> None:
    """Take up every folder that dead launchers of this host have left in `parent`."""
    # An earlier result on its way out comes first: it may be the only whole one.
    for path in sorted(parent.glob(".*.partial-*"), key=lambda path: path.suffix != OLDER):
        found = _WORK.fullmatch(path.name)
        if found is None or not path.is_dir() or found["host"] not in (None, socket.gethostname()):
            continue
        if _is_alive(int(found["pid"])):
            continue
        place = parent / found["name"]
        if found["older"]:
            _restore(path, place)
            continue
        end_strays(str(path.resolve()))
        rescue(path, place, f"{LAUNCHER}: killed")


def rescue(
    work: Path, place: Path, reason: str, granted_ns: Mapping[str, int] | None = None
) -> Path | None:
    """Give what is in `work` its place and return that; None if nothing is kept.

    Args:
        work: where a run was written.
        place: where it belongs.
        reason: why it did not end.
        granted_ns: last time granted to each federate, as far as it is known.
    """
    with held(work) as is_free:
        if not is_free:
            return None
        if not is_result(work) or _was_replaced(work, place):
            shutil.rmtree(work, ignore_errors=True)
            return None
        clear(work)
        manifest = dict(read_manifest(work))
        if manifest["reason"] == UNDER_WAY:
            manifest |= {"reason": reason, "granted_ns": dict(granted_ns or {})}
            write_json(work / MANIFEST, manifest)
        kept = place if manifest["status"] == "complete" else place_of_incomplete(place)
        # First, since it takes no time; large tables do.
        put_in_place(work, kept)
        if manifest["status"] != "complete":
            write_json(kept / MANIFEST, manifest | _tables(kept))
    return kept


def rescue_sweep(folder: Path, reason: str) -> None:
    """Take up the points that were under way in the folder of a sweep, and mark it."""
    take_up(folder / "points")
    manifest = dict(read_manifest(folder))
    if manifest["reason"] == UNDER_WAY:
        write_json(folder / MANIFEST, manifest | {"reason": reason})


def main(argv: list[str]) -> None:
    """Rescue what a keeper's launcher has left, and say so."""
    work, place, told = Path(argv[0]), Path(argv[1]), argv[2] if len(argv) > 2 else ""
    granted_ns = _granted(told)
    reason = f"{LAUNCHER}: killed{granted_text(granted_ns)}"
    kept: Path | None = place
    if work == place:
        rescue_sweep(place, reason)
    else:
        kept = rescue(work, place, reason, granted_ns) if work.is_dir() else None
    if kept is not None:
        sys.stderr.write(f"{reason}\nwhat was written is in {kept}, marked incomplete\n")


def granted_text(granted_ns: Mapping[str, int]) -> str:
    """Return when each federate was granted last, in words; nothing if none was."""
    from tieline.units import ns_to_seconds

    told = [f"{name} {ns_to_seconds(at):.6f} s" for name, at in granted_ns.items() if at >= 0]
    return f" (last granted: {', '.join(told)})" if told else ""


def _granted(told: str) -> dict[str, int]:
    try:
        granted: dict[str, int] = json.loads(told)
    except ValueError:
        return {}
    return granted


def _was_replaced(work: Path, place: Path) -> bool:
    """Return whether `work` is the earlier result, whose place the new one has taken already."""
    if read_manifest(work)["reason"] == UNDER_WAY or not is_result(place):
        return False
    ages = [(folder / MANIFEST).stat().st_mtime_ns for folder in (work, place)]
    return ages[1] > ages[0]


def _restore(older: Path, place: Path) -> None:
    """Give an earlier result its name back, unless a new one has taken it."""
    if place.exists():
        shutil.rmtree(older, ignore_errors=True)
    else:
        older.rename(place)


def _tables(folder: Path) -> dict[str, Any]:
    from tieline.experiment.table_facts import table_facts
    from tieline.tables import salvage

    salvage(folder)
    return table_facts(folder)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


if __name__ == "__main__":
    main(sys.argv[1:])
