"""The event heap: events come out by time, and by rank within one instant."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.network.packet.heap import pop, push, replace_first
from tieline.network.packet.memory import HEAP_COLUMNS, NEVER, TIME, Layout

HEAP, PACKETS = 5, 128
RANK_OF_ANOTHER = 61

Times = st.lists(st.integers(0, 20), min_size=1, max_size=60)


def filled(times: list[int]) -> tuple[np.ndarray, Layout]:
    """Return memory with a heap that begins at a cell other than the first, and packets."""
    packets = HEAP + HEAP_COLUMNS * (len(times) + 5)
    cells = np.full(packets + PACKETS, -7, dtype=np.int64)
    cells[HEAP + TIME : packets : HEAP_COLUMNS] = NEVER
    # Of the other tables nothing is read: what rises in the heap has its packet and port asked for.
    layout = Layout(**dict.fromkeys(Layout._fields, 0) | {"heap": HEAP, "packets": packets})
    for size, time_ns in enumerate(times):
        push(size, time_ns, rank_of(size), cells, layout)
    return cells, layout


def rank_of(number: int) -> int:
    """Return ranks that neither rise nor fall with the order of pushing."""
    return 37 * number % 61


def emptied(cells: np.ndarray, layout: Layout, size: int) -> list[tuple[int, ...]]:
    """Return the events of a heap in the order in which they come out."""
    rows = []
    for left in range(size, 0, -1):
        rows.append(tuple(cells[HEAP : HEAP + HEAP_COLUMNS].tolist()))
        pop(left, cells, layout)
    return rows


# The first call compiles, so no deadline holds.
@settings(deadline=None)
@given(Times)
def test_events_come_out_in_the_order_of_time_and_number(times):
    """Otherwise a packet would arrive before it was sent, or ties would depend on chance."""
    expected = sorted((time_ns, rank_of(k)) for k, time_ns in enumerate(times))
    cells, layout = filled(times)
    assert emptied(cells, layout, len(times)) == expected
    assert np.all(cells[:HEAP] == -7)
    assert np.all(cells[layout.packets :] == -7)
    assert np.all(cells[HEAP + TIME : layout.packets : HEAP_COLUMNS] == NEVER)


@settings(deadline=None)
@given(Times, st.integers(0, 20))
def test_replacing_the_first_is_a_pop_and_a_push(times, time_ns):
    """Otherwise a packet that goes on to its next link would lose its place in time."""
    cells, layout = filled(times)
    replace_first(len(times), time_ns, RANK_OF_ANOTHER, cells, layout)
    rest = sorted((t, rank_of(k)) for k, t in enumerate(times))[1:]
    assert emptied(cells, layout, len(times)) == sorted([*rest, (time_ns, RANK_OF_ANOTHER)])
