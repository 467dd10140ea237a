"""Federates that pause at random: `python pausing.py SEED grid|network|together RUN.json`."""

import random
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tieline.cosim import together
from tieline.cosim.federate import main
from tieline.cosim.interfaces import FEDERATES, GRID, Participant
from tieline.grid.federate import open_participant as open_grid
from tieline.network.federate import open_participant as open_network

LONGEST_S = 0.02


class Pausing:
    """A participant that now and then takes its time before and after its work."""

    def __init__(self, inner: Participant, seed: int) -> None:
        self.name = inner.name
        self._inner = inner
        self._random = random.Random(seed)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def advance(self, k: int, received: bytes) -> bytes:
        self._pause()
        sent = self._inner.advance(k, received)
        self._pause()
        return sent

    def _pause(self) -> None:
        if self._random.random() < 0.2:
            time.sleep(self._random.random() * LONGEST_S)


def opener(role: str, seed: int) -> Callable[[dict[str, Any], Path], Participant]:
    """Return what opens a pausing grid or network."""
    inner = open_grid if role == GRID else open_network
    return lambda run, folder: Pausing(inner(run, folder), seed)


if __name__ == "__main__":
    seed, role = int(sys.argv.pop(1)), sys.argv.pop(1)
    if role in FEDERATES:
        main(role, opener(role, seed))
    else:
        together.main({name: opener(name, seed + i) for i, name in enumerate(FEDERATES)})
