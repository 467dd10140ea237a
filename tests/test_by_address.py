"""Functions that compiled code calls by number."""

import numpy as np
import pytest
from numba import types
from numba.core.errors import NumbaError

from tieline.by_address import caller, first_class
from tieline.compiled import IS_ON, compiled_in_place

ROW = types.float64[::1]
SIGNATURE = types.void(ROW, ROW)
call = caller(SIGNATURE)


def _doubled(x: np.ndarray, y: np.ndarray) -> None:
    y[:] = 2.0 * x


def _squared(x: np.ndarray, y: np.ndarray) -> None:
    y[:] = x * x


@compiled_in_place
def _one_after_the_other(functions: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    for number in range(len(functions)):
        call(functions, number, (x, y[number]))


def test_each_function_is_called_by_its_number():
    """Otherwise a governor's equations would be evaluated for an exciter."""
    x, y = np.array([1.0, 2.0, 3.0]), np.zeros((2, 3))
    _one_after_the_other(first_class([_doubled, _squared], SIGNATURE), x, y)
    assert y.tolist() == [[2.0, 4.0, 6.0], [1.0, 4.0, 9.0]]
    _one_after_the_other(first_class([_squared, _doubled], SIGNATURE), x, y)
    assert y.tolist() == [[1.0, 4.0, 9.0], [2.0, 4.0, 6.0]]


@pytest.mark.skipif(not IS_ON, reason="NumPy takes any array")
def test_an_array_of_another_layout_is_refused():
    """A function would read every second number of it as its neighbour."""
    functions = first_class([_doubled, _squared], SIGNATURE)
    with pytest.raises(NumbaError):
        _one_after_the_other(functions, np.arange(6.0)[::2], np.zeros((2, 3)))
