"""The random streams of a network, of which the kernel holds two chunks each."""

import numpy as np

from tieline.network.draws import Chunks
from tieline.network.jitter import Jitter
from tieline.network.packet.draws import jitters
from tieline.network.packet.memory import COLUMNS, FIRST_DRAW, NONE, Cells


class Supplies:
    """The random streams of a network, numbered as they are opened."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.chunks: list[Chunks] = []

    def open(self, chunks: Chunks) -> int:
        """Return the number of a new stream."""
        self.chunks.append(chunks)
        return len(self.chunks) - 1

    def jitter(self, name: str, jitter: Jitter | None) -> int:
        """Return the stream of a jitter, or `NONE` if there is none."""
        return NONE if jitter is None else self.open(jitters(self.seed, name, jitter))

    def first_draws(self) -> Cells:
        """Return the table of streams with two chunks of each."""
        table = np.zeros((len(self.chunks), COLUMNS["streams"]), dtype=np.int64)
        for row, chunks in zip(table, self.chunks, strict=True):
            row[FIRST_DRAW:] = np.concatenate([next(chunks), next(chunks)])
        return table
