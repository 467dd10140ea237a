"""Both federates in one process, one of them spoilt after ten intervals: `spoilt.py HOW RUN.json`.

Each way stands for a fault of tieline itself that no input brings about.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tieline.cosim.interfaces import GRID, NETWORK, Participant
from tieline.cosim.together import main
from tieline.grid.federate import open_participant as open_grid
from tieline.grid.models.base import SIGNALS
from tieline.network.federate import open_participant as open_network

AT = 10


def miscount(network: Any) -> None:
    """The engine believes in a packet that nobody sent."""
    network._engine._sent += 1


def lost_statistics(network: Any) -> None:
    """The statistics forget a frame that was sent, a packet of each flow from its PMU."""
    network._recorder._flows._sent[0] -= 1


def field_voltage(grid: Any) -> None:
    """An algebraic signal is no number."""
    watch = grid._grid._watch
    watch.scale[watch.quantity == SIGNALS.index("Efd"), 6] = np.nan


def frequency(grid: Any) -> None:
    """A PMU's filter has run away, further than a frame's single precision reaches."""
    sensors = grid._grid.system.plan.sensors
    grid._grid._x[sensors.x0 + len(sensors.bus) + 2] = 1e60


def state(grid: Any) -> None:
    """A state is no number."""
    grid._grid._x[grid._grid.system.labels.index("omega.G7")] = np.nan
    grid._grid._is_current = False


WAYS: dict[str, tuple[str, Callable[[Any], None]]] = {
    "miscount": (NETWORK, miscount),
    "lost statistics": (NETWORK, lost_statistics),
    "field voltage": (GRID, field_voltage),
    "frequency": (GRID, frequency),
    "state": (GRID, state),
}


def spoilt(opener: Callable[..., Any], spoil: Callable[[Any], None]) -> Callable[..., Participant]:
    """Return what opens a participant that is spoilt before interval `AT`."""

    def opened(run: dict[str, Any], folder: Path) -> Participant:
        participant = opener(run, folder)
        advance = participant.advance

        def advance_spoilt(k: int, received: bytes) -> bytes:
            if k == AT:
                spoil(participant)
            return bytes(advance(k, received))

        participant.advance = advance_spoilt
        return participant  # type: ignore[no-any-return]

    return opened


if __name__ == "__main__":
    side, way = WAYS[sys.argv.pop(1)]
    openers: dict[str, Callable[..., Any]] = {GRID: open_grid, NETWORK: open_network}
    openers[side] = spoilt(openers[side], way)
    main(openers)
