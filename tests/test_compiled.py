"""Compiled code and its cache."""

import os
import subprocess
import sys
import threading
from collections import namedtuple
from pathlib import Path

import numba
import pytest

from tieline import kernels
from tieline.compiled import IS_ON
from tieline.kernel_lock import Lock

pytestmark = pytest.mark.skipif(not IS_ON, reason="the compiler is switched off")

CONSTANTS = "GAIN = {gain}\n"
MODEL = """\
from constants import GAIN
from tieline.compiled import compiled

@compiled
def scaled(x):
    return GAIN * x

@compiled
def moved(x):
    return scaled(x) + 1.0
"""
SCRIPT = """\
import sys
from model import moved
sys.stdout.write(f"{moved(2.0)} {sum(moved.stats.cache_hits.values())}")
"""


def moved(folder: Path, gain: float, model: str = MODEL, **more: str) -> tuple[float, int, str]:
    """Return what a compiled function gives in a new process, and whether it was loaded."""
    (folder / "constants.py").write_text(CONSTANTS.format(gain=gain))
    (folder / "model.py").write_text(model)
    source = str(Path(kernels.__file__).parent.parent)
    paths = os.pathsep.join([str(folder), source])
    cache = {"XDG_CACHE_HOME": str(folder / "cache"), "PYTHONPATH": paths}
    environment = {**os.environ, **cache, "TMPDIR": str(folder)} | more
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-B", "-c", SCRIPT],
        env=environment | {key: value for key, value in more.items() if key == "NUMBA_CACHE_DIR"},
        cwd=folder,
        capture_output=True,
        check=True,
        text=True,
    )
    value, loaded = done.stdout.split()
    return float(value), int(loaded), done.stderr


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*.nbc")}


def test_what_was_compiled_is_loaded_until_something_that_it_uses_changes(tmp_path: Path) -> None:
    """A kernel with an old constant of another file would compute yesterday's model in silence."""
    assert moved(tmp_path, 2.0)[:2] == (5.0, 0)
    assert moved(tmp_path, 2.0, f"# a remark\n\n{MODEL}")[:2] == (5.0, 1)
    assert moved(tmp_path, 3.0)[:2] == (7.0, 0)
    assert moved(tmp_path, 2.0)[:2] == (5.0, 1)
    # One that a full disk cut off is compiled anew.
    for path in (tmp_path / "cache").rglob("*.nbc"):
        path.write_bytes(path.read_bytes()[:100])
    assert moved(tmp_path, 2.0)[:2] == (5.0, 0)
    # A function that is called counts as well as a constant.
    assert moved(tmp_path, 2.0, MODEL.replace("GAIN * x", "GAIN - x"))[:2] == (1.0, 0)


def test_fields_that_change_places_are_another_type() -> None:
    """Compiled code knows fields by their places: old code would take one for the other."""
    one, other = namedtuple("Plan", "a b"), namedtuple("Plan", "b a")
    told = [kernels._told((numba.typeof(kind(1.0, 2.0)),)) for kind in (one, other)]
    assert told[0] != told[1]


def test_where_no_folder_can_be_made_another_takes_what_is_compiled(tmp_path: Path) -> None:
    """A home that is no folder at all must not keep anyone from computing."""
    (tmp_path / "file").write_text("")
    value, loaded, said = moved(tmp_path, 2.0, XDG_CACHE_HOME=str(tmp_path / "file"))
    assert (value, loaded) == (5.0, 0)
    assert "cannot be written: compiled code is kept in" in said


def test_a_folder_that_the_user_names_is_used(tmp_path: Path) -> None:
    """Somebody who sets numba's own variable knows why."""
    chosen = tmp_path / "mine"
    moved(tmp_path, 2.0, NUMBA_CACHE_DIR=str(chosen))
    assert files(chosen)
    assert not files(tmp_path / "cache")


def test_the_second_waits_until_the_first_has_compiled(tmp_path: Path) -> None:
    """Two runs begun at once would otherwise each compile for a minute."""
    first, second = Lock(tmp_path / "f.lock"), Lock(tmp_path / "f.lock")
    made = tmp_path / "f.nbc"
    assert first.acquire(made.exists)
    got: list[bool] = []
    waiting = threading.Thread(target=lambda: got.append(second.acquire(made.exists)))
    waiting.start()
    made.write_text("")
    waiting.join(30)
    first.release()
    assert got == [False]
    assert not (tmp_path / "f.lock").exists()


def test_only_the_newest_versions_of_a_function_stay(tmp_path: Path) -> None:
    """Every edit of a model leaves a file behind; they must not pile up."""
    for number in range(kernels.MOST_VERSIONS + 3):
        path = tmp_path / f"m.f-{number:02d}{kernels.SUFFIX}"
        path.write_text("")
        os.utime(path, (number, number))
    kernels._forget(tmp_path, "m.f")
    assert len(files(tmp_path)) == kernels.MOST_VERSIONS
    assert f"m.f-02{kernels.SUFFIX}" not in files(tmp_path)
