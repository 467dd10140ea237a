"""A heap of events in flat memory, each with four below it, for compiled code.

An event is a row (time_ns, rank) of the table `heap`, whose first event stands at the cell of that
name. The smallest (time_ns, rank) stands first, so that events of one instant come out by their
ranks, which the caller gives without repeats. The four below an event fill a line of the
processor's cache; behind the last event at least four rows have the time `NEVER`.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.packet.memory import HEAP_COLUMNS, NEVER, RANK, TIME, Cells


@compiled_from_zero
def push(cells: Cells, heap: int, size: int, time_ns: int, rank: int) -> None:
    """Add an event to a heap of `size` events; the table must have a row more than that."""
    place = size
    while place > 0:
        above = heap + HEAP_COLUMNS * ((place - 1) >> 2)
        if not _precedes(cells, time_ns, rank, above):
            break
        _write(cells, heap + HEAP_COLUMNS * place, cells[above + TIME], cells[above + RANK])
        place = (place - 1) >> 2
    _write(cells, heap + HEAP_COLUMNS * place, time_ns, rank)


@compiled_from_zero
def replace_first(cells: Cells, heap: int, size: int, time_ns: int, rank: int) -> None:
    """Put an event in the place of the first and restore the order: a pop and a push in one."""
    row = heap
    end = heap + HEAP_COLUMNS * size
    below = below_of(heap, row)
    while below < end:
        first = first_of_four(cells, below)
        if _precedes(cells, time_ns, rank, first):
            break
        _write(cells, row, cells[first + TIME], cells[first + RANK])
        row = first
        below = below_of(heap, row)
    _write(cells, row, time_ns, rank)


@compiled_from_zero
def pop(cells: Cells, heap: int, size: int) -> None:
    """Remove the first of `size` events, leaving `size` - 1."""
    last = heap + HEAP_COLUMNS * (size - 1)
    time_ns, rank = cells[last + TIME], cells[last + RANK]
    cells[last + TIME] = NEVER
    if size > 1:
        replace_first(cells, heap, size - 1, time_ns, rank)


@inlined
def below_of(heap: int, row: int) -> int:
    """Return where the four rows below one begin."""
    return heap + HEAP_COLUMNS + 4 * (row - heap)


@inlined
def first_of_four(cells: Cells, row: int) -> int:
    """Return the row of the event that comes first of four that follow each other."""
    # As numbers, not as branches: which comes first is a matter of chance.
    one = row + HEAP_COLUMNS * _is_second(cells, row, row + HEAP_COLUMNS)
    three = row + 2 * HEAP_COLUMNS
    two = three + HEAP_COLUMNS * _is_second(cells, three, three + HEAP_COLUMNS)
    return one + (two - one) * _is_second(cells, one, two)


@inlined
def _is_second(cells: Cells, one: int, two: int) -> int:
    return 1 * _precedes(cells, cells[two + TIME], cells[two + RANK], one)


@inlined
def _precedes(cells: Cells, time_ns: int, rank: int, row: int) -> bool:
    other_ns = cells[row + TIME]
    return (time_ns < other_ns) | ((time_ns == other_ns) & (rank < cells[row + RANK]))


@inlined
def _write(cells: Cells, row: int, time_ns: int, rank: int) -> None:
    cells[row + TIME] = time_ns
    cells[row + RANK] = rank
