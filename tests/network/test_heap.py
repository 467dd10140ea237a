"""The event heap: events come out by time, and by rank within one instant."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.network.packet.heap import pop, push, replace_first
from tieline.network.packet.memory import HEAP_COLUMNS, NEVER, TIME

Times = st.lists(st.integers(0, 20), min_size=1, max_size=60)


def filled(times: list[int], offset: int = 5) -> np.ndarray:
    """Return memory whose heap begins at a cell other than the first."""
    cells = np.full(offset + HEAP_COLUMNS * (len(times) + 5), -7, dtype=np.int64)
    cells[offset + TIME :: HEAP_COLUMNS] = NEVER
    for size, time_ns in enumerate(times):
        push(cells, offset, size, time_ns, rank_of(size))
    return cells


def rank_of(number: int) -> int:
    """Return ranks that neither rise nor fall with the order of pushing."""
    return 37 * number % 61


def emptied(cells: np.ndarray, size: int, offset: int = 5) -> list[tuple[int, ...]]:
    """Return the events of a heap in the order in which they come out."""
    rows = []
    for left in range(size, 0, -1):
        rows.append(tuple(cells[offset : offset + HEAP_COLUMNS].tolist()))
        pop(cells, offset, left)
    return rows


# The first call compiles, so no deadline holds.
@settings(deadline=None)
@given(Times)
def test_events_come_out_in_the_order_of_time_and_number(times):
    """Otherwise a packet would arrive before it was sent, or ties would depend on chance."""
    expected = sorted((time_ns, rank_of(k)) for k, time_ns in enumerate(times))
    cells = filled(times)
    assert emptied(cells, len(times)) == expected
    assert np.all(cells[:5] == -7)
    assert np.all(cells[5 + TIME :: HEAP_COLUMNS] == NEVER)


@settings(deadline=None)
@given(Times, st.integers(0, 20))
def test_replacing_the_first_is_a_pop_and_a_push(times, time_ns):
    """Otherwise a packet that goes on to its next link would lose its place in time."""
    cells = filled(times)
    replace_first(cells, 5, len(times), time_ns, 1000)
    rest = sorted((t, rank_of(k)) for k, t in enumerate(times))[1:]
    assert emptied(cells, len(times)) == sorted([*rest, (time_ns, 1000)])
