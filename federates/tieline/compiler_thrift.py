"""Spares numba work that it does again and again, or for nothing, when it compiles a kernel.

For each `a + b` numba asks all that it knows of `+` in turn: numbers, strings, lists, dates, sets,
and each twice; each asks in a table whose keys are compared option by option. And wherever an
array is assigned to a row, numba compiles what puts the two shapes into the text of an error, which
takes in half of its strings. Together that was half of the time in which kernels are compiled.
Neither changes what is computed.
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import types
from numba.core.compiler import Flags
from numba.core.extending import overload
from numba.core.registry import cpu_target
from numba.np import arrayobj

COLLECT_AFTER = 100_000
"""New objects after which Python looks for unreachable ones while it compiles; else some 700."""


def be_thrifty() -> None:
    """Have numba spare that work from now on in this process; a second call changes nothing."""
    context: Any = cpu_target.typing_context
    if not isinstance(context.resolve_function_type, _Remembered):
        context.resolve_function_type = _Remembered(context.resolve_function_type)
        options: Any = Flags
        options.__eq__, options.__hash__ = _equal, _hash
        arrayobj.raise_with_shape_context = raise_wrong_shape


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Look for unreachable objects seldom meanwhile: of so many, few can be freed so early."""
    thresholds = gc.get_threshold()
    gc.set_threshold(COLLECT_AFTER, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)


class _Remembered:
    """Stands in the place of a typing context's `resolve_function_type`.

    The answer for an operator and its types never changes, as long as it is no function that numba
    would compile with the caller's options.
    """

    def __init__(self, resolve: Callable[[Any, Any, Any], Any]) -> None:
        self._resolve = resolve
        self._answers: dict[tuple[int, Any], tuple[Any, Any]] = {}

    def __call__(self, function: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a function for types; None, or an error, where none fits."""
        if kws or not isinstance(function, types.Function):
            return self._resolve(function, args, kws)
        key = (id(function), args)
        if key not in self._answers:
            signature = self._resolve(function, args, kws)
            if signature is None or not _is_built_in(function, signature):
                return signature
            # Held with the function, lest another one takes over its number.
            self._answers[key] = function, signature
        return self._answers[key][1]


def _is_built_in(function: Any, signature: Any) -> bool:
    """Return whether numba makes the code of a function by itself, from its types alone."""
    is_own = function._impl_keys.get(signature.args) == function.typing_key
    return is_own and not any(isinstance(arg, types.Callable) for arg in signature.args)


def _equal(mine: Any, other: Any) -> Any:
    """Compare options of a compilation: as a rule they are the very same, or the same are set."""
    if mine is other or (isinstance(other, Flags) and mine._values == other._values):
        return True
    return super(Flags, mine).__eq__(other)


def _hash(mine: Any) -> int:
    """Return the same for all options, as numba's does after a look at each."""
    return hash(Flags)


def raise_wrong_shape(source: Any, target: Any) -> None:
    """Raise ValueError; stands in the place of what names both shapes."""
    raise NotImplementedError


@overload(raise_wrong_shape)
def _raise_wrong_shape(source: Any, target: Any) -> Callable[[Any, Any], None]:
    def raise_it(source: Any, target: Any) -> None:
        raise ValueError("cannot assign to a slice from an array of another shape")

    return raise_it
