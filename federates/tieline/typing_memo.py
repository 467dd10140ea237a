"""Remembers which of numba's own functions fits which types, for code that is compiled later.

For each `a + b` numba asks all that it knows of `+` in turn: numbers, strings, lists, dates, sets,
and each twice. That was a third of the time in which a kernel is compiled. The answer for an
operator and its types never changes, as long as it is no function that numba would compile with
the caller's options.
"""

from typing import Any

from numba.core import types
from numba.core.registry import cpu_target


def remember() -> None:
    """Have numba remember, from now on in this process; a second call changes nothing."""
    context = cpu_target.typing_context
    if not isinstance(context.resolve_function_type, _Remembered):
        context.resolve_function_type = _Remembered(context)


class _Remembered:
    """Stands in the place of a typing context's `resolve_function_type`."""

    def __init__(self, context: Any) -> None:
        self._resolve = context.resolve_function_type
        self._answers: dict[Any, Any] = {}

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
    return function._impl_keys.get(signature.args) == function.typing_key
