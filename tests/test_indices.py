"""Compiled code whose indices are taken as they stand."""

import numpy as np
import pytest
from numba.core.errors import NumbaError

from tieline.compiled import IS_ON, compiled_from_zero, inlined


@inlined
def _plus_one(cells: np.ndarray, place: int) -> int:
    return cells[place] + 1


@compiled_from_zero
def _copied(cells: np.ndarray, table: np.ndarray) -> int:
    total = 0
    for place in range(len(cells)):
        row = place >> 1
        table[row, place & 1] = _plus_one(cells, place)
        cells[place] += table[row, place & 1]
        total += cells[place]
    return total


def test_elements_are_read_and_written_where_they_stand():
    """Otherwise the packet kernel would mix up the tables of its memory."""
    cells, table = np.arange(6), np.zeros((3, 2), dtype=np.int64)
    assert _copied(cells, table) == sum(2 * k + 1 for k in range(6))
    assert cells.tolist() == [2 * k + 1 for k in range(6)]
    assert table.ravel().tolist() == [k + 1 for k in range(6)]


@compiled_from_zero
def _first_of_doubles(cells: np.ndarray) -> int:
    doubles = np.empty(len(cells), np.int64)
    for place in range(len(cells)):
        doubles[place] = 2 * cells[place]
    return doubles[0]


@pytest.mark.skipif(not IS_ON, reason="without the compiler nothing counts references")
def test_a_function_that_makes_an_array_is_refused():
    """Otherwise nobody would count who holds the array, and its memory would never come back."""
    with pytest.raises(NumbaError):
        _first_of_doubles(np.arange(3))
