"""Switches numba on or off for the whole package, so that one code runs compiled or as plain NumPy.

Compiled code is cached beside its source (or in numba's user cache where that is read-only).
`TIELINE_COMPILER=off` leaves every function as it is written. Fast-math stays off: results must
not depend on how a compiler reorders sums.
"""

import os
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeVar

import numba
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.typed import List

Function = TypeVar("Function", bound=Callable[..., Any])

# numba calls first-class functions experimental at each compilation that sees one.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

IS_ON = os.environ.get("TIELINE_COMPILER", "on") != "off"


def compiled(function: Function) -> Function:
    """Return `function` compiled on first call and cached; unchanged with the compiler off."""
    if not IS_ON:
        return function
    return numba.njit(cache=True, error_model="numpy")(function)


def first_class(functions: Sequence[Callable[..., None]], signature: Any) -> Any:
    """Return functions of one signature as a list that compiled code can call by index.

    The caller is then compiled once, whatever the functions are. A typed list tells the compiled
    caller its type at once; a plain tuple would have every function's type worked out anew at each
    call, which costs more than a step of the grid.
    """
    if not IS_ON:
        return tuple(functions)
    result = List.empty_list(numba.types.FunctionType(signature))
    for function in functions:
        result.append(_first_class(function, signature))
    return result


@cache
def _first_class(function: Callable[..., None], signature: Any) -> Any:
    return numba.cfunc(signature, cache=True, error_model="numpy")(function)
