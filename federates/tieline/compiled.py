"""Switches numba on or off for the whole package, so that one code runs compiled or as plain NumPy.

`TIELINE_COMPILER=off` leaves every function as it is written. Fast-math stays off: results must
not depend on how a compiler reorders sums.

Compiled code is cached. numba renews a cached function when its own file changes, but not when a
constant or a function that it took from another file does; so each state of the package's source
has a cache folder of its own, in `$XDG_CACHE_HOME/tieline` unless NUMBA_CACHE_DIR names another.
What `UNCOMPILED` names takes no part in it: a new word in a report compiles nothing anew.
"""

import hashlib
import os
import shutil
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.typed import List

from tieline.indices import IndicesFromZero

Function = TypeVar("Function", bound=Callable[..., Any])

# numba calls first-class functions experimental at each compilation that sees one.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

UNCOMPILED = ("api", "cli", "compare", "doctor", "experiment", "paper", "report", "sweeps")
"""Parts of the package that hold no compiled code, and that none of it takes anything from."""

CACHES_KEPT = 4
"""Cache folders that stay, the newest first: those of other versions and checkouts."""


def _use_own_cache() -> None:
    """Point numba to the cache folder of this source; leave its default where none can be made."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    package = Path(__file__).resolve().parent
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        inside = path.relative_to(package)
        if inside.parts[0] not in UNCOMPILED:
            digest.update(inside.as_posix().encode() + path.read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tieline"
    folder = home / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        others = sorted(home.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    except OSError:
        return
    for old in others[CACHES_KEPT:]:
        shutil.rmtree(old, ignore_errors=True)
    numba.config.CACHE_DIR = str(folder)


def cached() -> tuple[Path | None, int]:
    """Return the cache folder in use (None: numba's own beside each file) and how much it holds.

    The second is the number of compiled functions.
    """
    folder = Path(numba.config.CACHE_DIR) if numba.config.CACHE_DIR else None
    return folder, 0 if folder is None else sum(1 for _ in folder.rglob("*.nbi"))


IS_ON = os.environ.get("TIELINE_COMPILER", "on") != "off"
if IS_ON:
    _use_own_cache()


def compiled(function: Function) -> Function:
    """Return `function` compiled on first call and cached; unchanged with the compiler off.

    It runs without the interpreter's lock, so that both federates of one process work at once.
    """
    if not IS_ON:
        return function
    return numba.njit(cache=True, nogil=True, error_model="numpy")(function)


def compiled_from_zero(function: Function) -> Function:
    """Return `function` as `compiled` does; no index in it is negative, and none is a slice."""
    if not IS_ON:
        return function
    options = {"cache": True, "nogil": True, "error_model": "numpy"}
    return numba.njit(**options, pipeline_class=IndicesFromZero)(function)


def inlined(function: Function) -> Function:
    """Return `function` as `compiled` does, put into each of its callers in place of a call."""
    if not IS_ON:
        return function
    options = {"nogil": True, "error_model": "numpy", "inline": "always"}
    return numba.njit(**options)(function)


def first_class(functions: Sequence[Callable[..., None]], signature: Any) -> Any:
    """Return functions of one signature as a list that compiled code can call by index.

    The caller is then compiled once, whatever the functions are. A typed list tells the compiled
    caller its type at once; a plain tuple would have every function's type worked out anew at each
    call, which costs more than a step of the grid.
    """
    if not IS_ON:
        return tuple(functions)
    first, *others = (_first_class(function, signature) for function in functions)
    result = _list_of(first)
    for function in others:
        _append(result, function)
    return result


@compiled
def _list_of(function: Any) -> Any:
    # A typed list's own methods are compiled anew in every process; these two are cached.
    result = List()
    result.append(function)
    return result


@compiled
def _append(functions: Any, function: Any) -> None:
    functions.append(function)


@cache
def _first_class(function: Callable[..., None], signature: Any) -> Any:
    return numba.cfunc(signature, cache=True, error_model="numpy")(function)
