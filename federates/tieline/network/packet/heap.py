"""A binary heap of events in flat memory, for compiled code.

An event is a row (time_ns, order, item) of the table that begins at `heap`. The smallest (time_ns,
order) stands first, so that events of one instant come out by their order numbers, which the caller
gives without repeats.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.packet.memory import HEAP_COLUMNS, ITEM, ORDER, TIME, Cells


@compiled_from_zero
def push(cells: Cells, heap: int, size: int, time_ns: int, order: int, item: int) -> None:
    """Add an event to a heap of `size` events; the table must have a row more than that."""
    place = size
    while place > 0:
        parent = (place - 1) >> 1
        if not _precedes(cells, time_ns, order, heap + HEAP_COLUMNS * parent):
            break
        _move(cells, heap + HEAP_COLUMNS * parent, heap + HEAP_COLUMNS * place)
        place = parent
    _write(cells, heap + HEAP_COLUMNS * place, time_ns, order, item)


@compiled_from_zero
def replace_first(cells: Cells, heap: int, size: int, time_ns: int, order: int, item: int) -> None:
    """Put an event in the place of the first and restore the order: a pop and a push in one."""
    place, row = 0, heap
    child, below = 1, heap + HEAP_COLUMNS
    while child + 1 < size:
        # As a number, not as a branch: which child comes first is a matter of chance.
        is_second = 1 * _precedes(
            cells, cells[below + HEAP_COLUMNS], cells[below + HEAP_COLUMNS + ORDER], below
        )
        child += is_second
        below += HEAP_COLUMNS * is_second
        if _precedes(cells, time_ns, order, below):
            _write(cells, row, time_ns, order, item)
            return
        _move(cells, below, row)
        place, row = child, below
        child = 2 * place + 1
        below = heap + HEAP_COLUMNS * child
    if child < size and not _precedes(cells, time_ns, order, below):
        _move(cells, below, row)
        row = below
    _write(cells, row, time_ns, order, item)


@compiled_from_zero
def pop(cells: Cells, heap: int, size: int) -> None:
    """Remove the first of `size` events, leaving `size` - 1."""
    last = heap + HEAP_COLUMNS * (size - 1)
    if size > 1:
        replace_first(
            cells, heap, size - 1, cells[last + TIME], cells[last + ORDER], cells[last + ITEM]
        )


@inlined
def _precedes(cells: Cells, time_ns: int, order: int, row: int) -> bool:
    other_ns = cells[row + TIME]
    return (time_ns < other_ns) | ((time_ns == other_ns) & (order < cells[row + ORDER]))


@inlined
def _move(cells: Cells, origin: int, row: int) -> None:
    cells[row + TIME] = cells[origin + TIME]
    cells[row + ORDER] = cells[origin + ORDER]
    cells[row + ITEM] = cells[origin + ITEM]


@inlined
def _write(cells: Cells, row: int, time_ns: int, order: int, item: int) -> None:
    cells[row + TIME] = time_ns
    cells[row + ORDER] = order
    cells[row + ITEM] = item
