"""Compiled functions that call each other: one machine code for all that a caller needs."""

import numba
import numpy as np
import pytest
from numba import types
from numba.core.caching import NullCache

from tieline.by_address import caller, first_class
from tieline.compiled import IS_ON, compiled, compiled_from_zero

pytestmark = pytest.mark.skipif(not IS_ON, reason="the compiler is switched off")


@compiled_from_zero
def element(x, i):
    return x[i]


@compiled
def copied(into, x):
    into[:] = x
    return element(x, 0)


@compiled
def both(into, x):
    return copied(into, x) + element(x, 1)


@compiled
def outer(into, x):
    return both(into, x) + element(x, 1)


def squared(x, y):
    y[0] = element(x, 0) ** 2


signature = types.void(types.float64[::1], types.float64[::1])
call = caller(signature)


@compiled
def called(functions, x, y):
    call(functions, 0, (x, y))


@numba.njit
def of_a_user(x):
    return 2.0 * element(x, 1)


def test_a_function_serves_compiled_callers_and_python_alike() -> None:
    """Whoever calls first must not leave a function that nobody else can call."""
    x, into = np.array([1.0, 10.0]), np.zeros(2)
    assert outer(into, x) == 21.0
    assert into.tolist() == [1.0, 10.0]
    assert both(into, x) == 11.0
    assert element(x, 1) == 10.0
    assert of_a_user(x) == 20.0
    assert outer(into, x) == 21.0


def test_what_only_compiled_code_calls_gets_no_machine_code() -> None:
    """Each inner function would else cost its optimisation again: the first run takes minutes."""

    @compiled
    def inner(x):
        return x + 1.0

    inner.get_call_template((types.float64,), {})
    (translation,) = inner._inner.overloads.values()
    assert not translation.library._finalized
    assert not inner.overloads
    assert inner(1.0) == 2.0


def test_what_the_wrapper_needs_is_its_own() -> None:
    """A file with the translation alone, read first, would leave Python's caller without types."""

    @compiled
    def pair(x):
        return x + 1.0, 2.0 * x

    pair._cache = NullCache()  # a kept file would leave nothing to translate
    assert [part.tolist() for part in pair(np.array([3.0]))] == [[4.0], [6.0]]
    (whole,), (translation,) = pair.overloads.values(), pair._inner.overloads.values()
    assert whole.environment is not translation.environment
    assert whole.environment.env_name != translation.environment.env_name
    assert len(whole.environment.consts) > len(translation.environment.consts)


def test_an_error_within_reaches_python() -> None:
    """A shape that does not fit must be told, not written past the end of an array."""
    for _ in range(2):
        with pytest.raises(ValueError, match="cannot assign to a slice"):
            outer(np.zeros(3), np.zeros(2))


def test_a_list_of_functions_takes_those_that_call_others() -> None:
    """The models' equations are called through their addresses, and call blocks."""
    y = np.zeros(1)
    called(first_class([squared], signature), np.array([3.0]), y)
    assert y[0] == 9.0


def test_a_function_is_translated_once_for_all_constants() -> None:
    """Each place that writes a word of a frame would cost a first run a translation."""

    @compiled_from_zero
    def at(x, i):
        return x[i]

    @compiled
    def difference(x):
        return at(x, 2) - at(x, 1)

    difference._cache = NullCache()
    assert difference(np.arange(3.0)) == 1.0
    assert len(at._inner.overloads) == 1


def test_a_function_may_call_itself() -> None:
    """A user's model is free to."""

    @compiled
    def factorial(n):
        if n <= 1:
            return 1
        return n * factorial(n - 1)

    assert factorial(5) == 120
