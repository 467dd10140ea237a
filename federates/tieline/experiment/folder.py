"""A result folder as a place: what marks it, its JSON files, and how it takes its name."""

import errno
import fcntl
import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tieline.errors import InputError

MANIFEST = "manifest.json"
FORMAT = "tieline-result/1"
UNDER_WAY = "the run did not end: it is under way, or was killed"
RESERVE = ".reserve"
"""Keeps room for the manifest, and for small tables, on a disk that runs full."""
OLDER = ".older"
"""Ends the name of an earlier result on its way out, where two folders cannot change places."""

_OF_ALL: dict[str, type] = {"status": str, "name": str}
_OF_KIND: dict[str, dict[str, type]] = {
    "run": {"label": str, "config": dict},
    "sweep": {"points": list},
}
"""What the readers take from a manifest of each kind, whoever made it."""

_LONGEST_WAIT_S, _LOOK_S = 2.0, 0.01

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
_NOT_LOCKABLE = (errno.ENOLCK, errno.EBADF, errno.EOPNOTSUPP)


def read_json(path: Path) -> Any:
    """Return what a JSON file of a result holds.

    Raises:
        InputError: it is missing or malformed.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is no JSON ({error})") from error


def write_json(path: Path, data: object) -> None:
    """Write a JSON file that appears whole or not at all."""
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text + "\n", encoding="utf-8")
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def is_result(folder: Path) -> bool:
    """Return whether a folder is a result of tieline, whole or not."""
    try:
        manifest = read_json(folder / MANIFEST)
    except InputError:
        return False
    return isinstance(manifest, dict) and manifest.get("format") == FORMAT


def read_manifest(folder: Path) -> Mapping[str, Any]:
    """Return the manifest of a run or a sweep.

    Raises:
        InputError: the folder is no result, or its manifest lacks what every one has.
    """
    if not is_result(folder):
        raise InputError(f"{folder} is no result folder: it has no {MANIFEST} of {FORMAT}")
    manifest: Mapping[str, Any] = read_json(folder / MANIFEST)
    _check_manifest(folder / MANIFEST, manifest)
    return manifest


def _check_manifest(path: Path, manifest: Mapping[str, Any]) -> None:
    kind = manifest.get("kind")
    if not isinstance(kind, str) or kind not in _OF_KIND:
        raise InputError(f"{path}: is damaged: its 'kind' is {kind!r:.60}")
    for key, type_ in (_OF_ALL | _OF_KIND[kind]).items():
        if not isinstance(manifest.get(key), type_):
            raise InputError(f"{path}: is damaged: its '{key}' is {manifest.get(key)!r:.60}")
    for point in manifest["points"] if kind == "sweep" else ():
        slug = point.get("slug") if isinstance(point, dict) else None
        # A point's folder stands beside its fellows, and nowhere else.
        if not isinstance(slug, str) or Path(slug).name != slug or "\0" in slug:
            raise InputError(f"{path}: is damaged: a point's 'slug' is {slug!r:.60}")


def put_in_place(work: Path, place: Path) -> None:
    """Give a folder its name at once; what bore the name goes.

    Whoever looks, whenever this is killed, finds the old folder or the new one. Where the file
    system cannot have two folders change places there is an instant with neither, of which the old
    one waits under another name, for `take_up`.
    """
    if not place.is_dir() or not any(place.iterdir()):
        work.rename(place)
        return
    older = work
    if not _exchange(work, place):
        older = work.with_name(work.name + OLDER)
        place.rename(older)
        work.rename(place)
    # What cannot be removed now is removed with the next run's leftovers; the result is whole.
    shutil.rmtree(older, ignore_errors=True)


def place_of_incomplete(place: Path) -> Path:
    """Return where an incomplete result belongs: it overwrites nothing whole."""
    has_whole = is_result(place) and read_json(place / MANIFEST).get("status") == "complete"
    return place.with_name(f"{place.name}-incomplete") if has_whole else place


def clear(folder: Path) -> None:
    """Remove what is nothing without the process that was writing it: half-written files."""
    for path in folder.rglob(".*.part"):
        path.unlink(missing_ok=True)
    (folder / RESERVE).unlink(missing_ok=True)


@contextmanager
def held(folder: Path) -> Iterator[bool]:
    """Hold a folder until the context or this process ends; give whether it was free.

    Where folders cannot be locked (some shared file systems) every folder counts as free.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    is_free = True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        is_free = False
    except OSError as error:
        if error.errno not in _NOT_LOCKABLE:
            os.close(descriptor)
            raise
    try:
        yield is_free
    finally:
        os.close(descriptor)


@contextmanager
def waited_for(folder: Path) -> Iterator[None]:
    """Hold a folder for an instant; wait a little while another does so."""
    limit_s = time.monotonic() + _LONGEST_WAIT_S
    while True:
        with held(folder) as free:
            if free or time.monotonic() > limit_s:
                yield
                return
        time.sleep(_LOOK_S)


def is_free(folder: Path) -> bool:
    """Return whether nobody holds a folder; one that is gone is free."""
    try:
        with held(folder) as free:
            return free
    except OSError:
        return True


def _exchange(one: Path, other: Path) -> bool:
    """Let two folders change places at once; False where kernel or file system cannot."""
    # Here, since it is needed once a run, and costs a start.
    import ctypes

    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    names = (os.fsencode(one), os.fsencode(other))
    done = rename(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE)
    return bool(done == 0)
