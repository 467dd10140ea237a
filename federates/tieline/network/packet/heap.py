"""A heap of events in flat memory, each with four below it, for compiled code.

An event is a row (time_ns, rank) of the table `heap`, whose first event stands at the cell of that
name. The smallest (time_ns, rank) stands first, so that events of one instant come out by their
ranks, which the caller gives without repeats. The four below an event fill a line of the
processor's cache; behind the last event at least four rows have the time `NEVER`.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.packet.ahead import ask_for_packet, ask_for_port
from tieline.network.packet.memory import HEAP_COLUMNS, NEVER, RANK, TIME, Cells, Layout


@compiled_from_zero
def push(size: int, time_ns: int, rank: int, cells: Cells, at: Layout) -> None:
    """Add an event to a heap of `size` events; the table must have a row more than that."""
    heap, place = at.heap, size
    while place > 0:
        above = heap + HEAP_COLUMNS * ((place - 1) >> 2)
        if not _precedes(cells, time_ns, rank, above):
            break
        _write(cells, heap + HEAP_COLUMNS * place, cells[above + TIME], cells[above + RANK])
        place = (place - 1) >> 2
    _write(cells, heap + HEAP_COLUMNS * place, time_ns, rank)


@compiled_from_zero
def replace_first(size: int, time_ns: int, rank: int, cells: Cells, at: Layout) -> None:
    """Put an event in the place of the first and restore the order: a pop and a push in one.

    For events that rise to the upper levels, what they need is asked for.
    """
    row, level = at.heap, 0
    end = at.heap + HEAP_COLUMNS * size
    below = _below(row, at)
    while below < end:
        first = _first_of_four(cells, below)
        if _precedes(cells, time_ns, rank, first):
            break
        risen = cells[first + RANK]
        _write(cells, row, cells[first + TIME], risen)
        if level == 1:
            ask_for_port(risen, cells, at)
        elif level == 2:
            ask_for_packet(risen, cells, at)
        row = first
        level += 1
        below = _below(row, at)
    _write(cells, row, time_ns, rank)


@compiled_from_zero
def pop(size: int, cells: Cells, at: Layout) -> None:
    """Remove the first of `size` events, leaving `size` - 1."""
    last = at.heap + HEAP_COLUMNS * (size - 1)
    time_ns, rank = cells[last + TIME], cells[last + RANK]
    cells[last + TIME] = NEVER
    if size > 1:
        replace_first(size - 1, time_ns, rank, cells, at)


@inlined
def _below(row: int, at: Layout) -> int:
    """Return where the four rows below one begin."""
    return at.heap + HEAP_COLUMNS + 4 * (row - at.heap)


@inlined
def _first_of_four(cells: Cells, row: int) -> int:
    """Return the row of the event that comes first of four that follow each other."""
    a_ns, b_ns = cells[row + TIME], cells[row + HEAP_COLUMNS + TIME]
    c_ns, d_ns = cells[row + 2 * HEAP_COLUMNS + TIME], cells[row + 3 * HEAP_COLUMNS + TIME]
    left_ns, right_ns = min(a_ns, b_ns), min(c_ns, d_ns)
    least_ns = min(left_ns, right_ns)
    # As numbers, not as branches: which comes first is a matter of chance.
    of_left, of_right = 1 * (b_ns < a_ns), 2 + (d_ns < c_ns)
    place = of_left ^ ((of_left ^ of_right) & (-1 * (right_ns < left_ns)))
    if 1 * (a_ns == least_ns) + (b_ns == least_ns) + (c_ns == least_ns) + (d_ns == least_ns) > 1:
        place = _first_of_equals(least_ns, cells, row)
    return row + HEAP_COLUMNS * place


@compiled_from_zero
def _first_of_equals(least_ns: int, cells: Cells, row: int) -> int:
    """Return which of four events of an instant, or of those that have it, has the least rank."""
    place, least = 0, NEVER
    for other in range(4):
        rank = cells[row + HEAP_COLUMNS * other + RANK]
        if cells[row + HEAP_COLUMNS * other + TIME] == least_ns and rank < least:
            place, least = other, rank
    return place


@inlined
def _precedes(cells: Cells, time_ns: int, rank: int, row: int) -> bool:
    other_ns = cells[row + TIME]
    return (time_ns < other_ns) | ((time_ns == other_ns) & (rank < cells[row + RANK]))


@inlined
def _write(cells: Cells, row: int, time_ns: int, rank: int) -> None:
    cells[row + TIME] = time_ns
    cells[row + RANK] = rank
