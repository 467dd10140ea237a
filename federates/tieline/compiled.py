"""Switches numba on or off for the whole package, so that one code runs compiled or as plain NumPy.

`TIELINE_COMPILER=off` leaves every function as it is written. Fast-math stays off: results must
not depend on how a compiler reorders sums. Compiled code is kept as `tieline.kernels` says.
"""

import os
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.compiler import Compiler, CompilerBase
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.core.registry import cpu_target
from numba.typed import List

from tieline import kernels
from tieline.indices import IndicesFromZero
from tieline.whole_program import Callback, Kernel

Function = TypeVar("Function", bound=Callable[..., Any])

# numba calls first-class functions experimental at each compilation that sees one.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

IS_ON = os.environ.get("TIELINE_COMPILER", "on") != "off"


def cached() -> tuple[Path | None, int]:
    """Return the folder that takes compiled functions (None: there is none) and how many exist."""
    return kernels.folder(), kernels.count()


def load_compiler() -> None:
    """Import what the first compiled function of a process imports, half a second for each fork."""
    if IS_ON:
        cpu_target.typing_context.refresh()


def compiled(function: Function) -> Function:
    """Return `function` compiled on first call and cached; unchanged with the compiler off.

    It runs without the interpreter's lock, so that both federates of one process work at once.
    """
    return _kept(function, Compiler) if IS_ON else function


def compiled_from_zero(function: Function) -> Function:
    """Return `function` as `compiled` does; no index in it is negative, and none is a slice."""
    return _kept(function, IndicesFromZero) if IS_ON else function


def inlined(function: Function) -> Function:
    """Return `function` as `compiled_from_zero` does, put into its callers in place of a call."""
    return _kept(function, IndicesFromZero, forceinline=True) if IS_ON else function


def _kept(function: Function, pipeline: type[CompilerBase], **more: bool) -> Function:
    options = {"nogil": True, "error_model": "numpy", "forceinline": False, **more}
    result: Any = Kernel(function, {}, {"nopython": True, "boundscheck": None, **options}, pipeline)
    result._cache = kernels.Kernels(function, f"{pipeline.__name__} {options}")
    kept: Function = result
    return kept


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
    options = {"error_model": "numpy"}
    result: Any = Callback(function, signature, options)
    result._cache = kernels.Kernels(function, f"callback {options}")
    result.compile()
    return result
