"""The same two participants in one process, without HELICS."""

from collections import deque
from collections.abc import Callable

from tieline.cosim.exchange import first_deliveries
from tieline.cosim.interfaces import GRID, NETWORK, Clock, Participant, lag_ns


def run_local(
    grid: Participant,
    network: Participant,
    clock: Clock,
    progress: Callable[[str, int, int], None] | None = None,
) -> None:
    """Take both participants through every stride, in the order that the federation grants.

    Args:
        grid: the grid's side.
        network: the network's side.
        clock: the instants at which they meet.
        progress: called with (name, k, granted time in ns) before each turn.

    Raises:
        Exception: whatever a participant raised, after both were told to abort.
    """
    try:
        _run(grid, network, clock, progress)
    except Exception as error:
        for participant in (grid, network):
            participant.abort(str(error))
        raise


def _run(
    grid: Participant,
    network: Participant,
    clock: Clock,
    progress: Callable[[str, int, int], None] | None,
) -> None:
    def granted(name: str, k: int) -> None:
        if progress is not None:
            progress(name, k, clock.at_ns(k) + lag_ns(name, clock))

    [frames] = grid.start()
    ready = deque(first_deliveries(network, clock))
    for k in clock.meetings():
        granted(NETWORK, k)
        ready.append(network.advance(k, frames))
        granted(GRID, k)
        frames = grid.advance(k, ready.popleft())
    for name in (NETWORK, GRID):
        granted(name, clock.intervals)
    network.advance(clock.intervals, frames)
    network.finish()
    grid.finish()
