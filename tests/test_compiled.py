"""Compiled code and its cache."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import tieline

SCRIPT = "import numba; import tieline.compiled; print(numba.config.CACHE_DIR)"


def cache_of(package: Path, home: Path, **more: str) -> str:
    """Return the cache folder that a copy of the package uses."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(home), "PYTHONPATH": str(package.parent)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=environment | more,
        cwd=home,
        capture_output=True,
        check=True,
        text=True,
    )
    return done.stdout.strip()


def copy_of_package(folder: Path) -> Path:
    target = folder / "source" / "tieline"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(tieline.__file__).parent, target, ignore=ignored)
    return target


def test_a_change_anywhere_in_the_source_gets_another_cache(tmp_path: Path) -> None:
    """A cached kernel with an old constant in it would compute yesterday's model in silence."""
    package = copy_of_package(tmp_path)
    first = cache_of(package, tmp_path)
    assert cache_of(package, tmp_path) == first
    blocks = package / "grid" / "models" / "blocks.py"
    blocks.write_text(blocks.read_text() + "\n# changed\n")
    assert cache_of(package, tmp_path) != first


def test_only_the_newest_caches_stay(tmp_path: Path) -> None:
    """Every upgrade leaves some megabytes behind; they must not pile up."""
    package = copy_of_package(tmp_path)
    home = tmp_path / "tieline"
    home.mkdir()
    for number in range(6):
        (home / f"old{number}").mkdir()
        os.utime(home / f"old{number}", (number, number))
    used = Path(cache_of(package, tmp_path))
    assert {path.name for path in home.iterdir()} == {used.name, "old5", "old4", "old3"}


def test_a_cache_that_the_user_names_is_left_alone(tmp_path: Path) -> None:
    """Somebody who sets numba's own variable knows why."""
    package = copy_of_package(tmp_path)
    chosen = str(tmp_path / "mine")
    assert cache_of(package, tmp_path, NUMBA_CACHE_DIR=chosen) == chosen
    assert not (tmp_path / "tieline").exists()
