"""Switches numba on or off for the whole package, so that one code runs compiled or as plain NumPy.

`TIELINE_COMPILER=off` leaves every function as it is written. Fast-math stays off: results must
not depend on how a compiler reorders sums. Compiled code is kept as `tieline.kernels` says.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba.core.compiler import Compiler, CompilerBase
from numba.core.registry import cpu_target

from tieline import kernels
from tieline.indices import IndicesFromZero
from tieline.whole_program import Kernel

Function = TypeVar("Function", bound=Callable[..., Any])

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


def compiled_in_place(function: Function) -> Function:
    """Return `function` as `compiled` does; it works in arrays that it is given and makes none.

    numba counts who holds an array: much to translate where there are forty of them, and locks of
    the memory in loops. The caller holds every array meanwhile.
    """
    return _kept(function, Compiler, _nrt=False) if IS_ON else function


def compiled_from_zero(function: Function) -> Function:
    """Return `function` as `compiled_in_place` does; no index is negative, and none is a slice."""
    return _kept(function, IndicesFromZero, _nrt=False) if IS_ON else function


def inlined(function: Function) -> Function:
    """Return `function` as `compiled_from_zero` does, put into its callers in place of a call."""
    return _kept(function, IndicesFromZero, _nrt=False, forceinline=True) if IS_ON else function


def _kept(function: Function, pipeline: type[CompilerBase], **special: bool) -> Function:
    # What is not said here a function would inherit from the one whose compilation asks for it.
    options = {"nogil": True, "error_model": "numpy", "_nrt": True, "forceinline": False, **special}
    result: Any = Kernel(function, {}, {"nopython": True, "boundscheck": None, **options}, pipeline)
    result._cache = kernels.Kernels(function, f"{pipeline.__name__} {options}")
    kept: Function = result
    return kept
