"""Asking for memory ahead of its use."""

import numpy as np

from tieline.compiled import compiled_from_zero
from tieline.prefetch import prefetch


@compiled_from_zero
def ask(cells: np.ndarray, place: int) -> int:
    """Ask for a place of an array and return the number there if there is one."""
    prefetch(cells, place)
    return cells[place] if place < len(cells) else -1


def test_asking_changes_nothing_and_may_be_in_vain():
    """Otherwise a look ahead beyond the end of a table would end the run, or change a packet."""
    cells = np.arange(8)
    assert [ask(cells, place) for place in (3, 1 << 20, 1 << 50)] == [3, -1, -1]
    assert np.array_equal(cells, np.arange(8))
