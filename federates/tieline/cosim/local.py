"""The same two participants in one process, without HELICS."""

from collections.abc import Callable

from tieline.cosim.exchange import first_deliveries
from tieline.cosim.interfaces import GRID, NETWORK, Clock, Participant, lag_ns


def run_local(
    grid: Participant,
    network: Participant,
    clock: Clock,
    progress: Callable[[str, int, int], None] | None = None,
) -> None:
    """Take both participants through every interval, in the order that the federation grants.

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
    [frames] = grid.start()
    deliveries = first_deliveries(network, clock)
    for k in range(clock.intervals):
        if progress is not None:
            progress(NETWORK, k, clock.at_ns(k) + lag_ns(NETWORK, clock))
        deliveries.append(network.advance(k, frames))
        if progress is not None:
            progress(GRID, k, clock.at_ns(k) + lag_ns(GRID, clock))
        frames = grid.advance(k, deliveries.popleft())
    if progress is not None:
        for name in (NETWORK, GRID):
            progress(name, clock.intervals, clock.at_ns(clock.intervals) + lag_ns(name, clock))
    network.finish()
    grid.finish()
