"""Switches numba on or off for the whole package, so that one code runs compiled or as plain NumPy.

Compiled code is cached beside its source (or in numba's user cache where that is read-only).
`TIELINE_COMPILER=off` leaves every function as it is written. Fast-math stays off: results must
not depend on how a compiler reorders sums.
"""

import os
from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])

IS_ON = os.environ.get("TIELINE_COMPILER", "on") != "off"


def compiled(function: Function) -> Function:
    """Return `function` compiled on first call and cached; unchanged with the compiler off."""
    if not IS_ON:
        return function
    return numba.njit(cache=True, error_model="numpy")(function)


def compiled_for(signature: Any) -> Callable[[Function], Function]:
    """Return a decorator that compiles at once for `signature`, giving a first-class function.

    Functions of one signature can be held in a tuple and called by index from compiled code,
    which is then compiled once, whatever the functions are.
    """

    def decorate(function: Function) -> Function:
        if not IS_ON:
            return function
        return numba.cfunc(signature, cache=True, error_model="numpy")(function)

    return decorate
