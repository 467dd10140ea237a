"""The random streams of a network, of which the kernel holds two chunks each."""

import numpy as np

from tieline.network.draws import CHUNK, Chunks
from tieline.network.engine import StreamUse
from tieline.network.jitter import Jitter
from tieline.network.packet.draws import jitters
from tieline.network.packet.memory import COLUMNS, FIRST_DRAW, NONE, USED, Cells

JITTER = "jitter, ns"
LOSSES = "packets, or bits, from one loss to the next"
EARLY_DROPS = "early drops: a packet goes if its number is small enough"
GAPS = "ns from one datagram of cross traffic to the next"
SIZES = "bytes of each datagram, as recorded"


class Supplies:
    """The random streams of a network, numbered as they are opened.

    Attributes:
        seed: the experiment's.
        chunks: what is still to come of each stream.
        names: of each stream, as `tieline.streams.stream` has it.
        gives: in words, what the numbers of each stream are.
        refills: chunks that the kernel has asked for beyond the first two, of each stream.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.chunks: list[Chunks] = []
        self.names: list[str] = []
        self.gives: list[str] = []
        self.refills: list[int] = []

    def open(self, chunks: Chunks, name: str, gives: str) -> int:
        """Return the number of a new stream, whose numbers come from the generator of a name."""
        self.chunks.append(chunks)
        self.names.append(name)
        self.gives.append(gives)
        self.refills.append(0)
        return len(self.chunks) - 1

    def refill(self, number: int) -> Cells:
        """Return the next chunk of a stream."""
        self.refills[number] += 1
        return next(self.chunks[number])

    def taken(self, number: int, streams: Cells) -> int:
        """Return how many numbers of a stream the kernel has used, given its table of streams."""
        return CHUNK * self.refills[number] + int(streams[number, USED])

    def uses(self, streams: Cells) -> list[StreamUse]:
        """Return every stream, with the numbers used so far."""
        return [
            StreamUse(name, gives, self.taken(number, streams))
            for number, (name, gives) in enumerate(zip(self.names, self.gives, strict=True))
        ]

    def jitter(self, name: str, jitter: Jitter | None) -> int:
        """Return the stream of a jitter, or `NONE` if there is none."""
        if jitter is None:
            return NONE
        return self.open(jitters(self.seed, name, jitter), name, JITTER)

    def first_draws(self) -> Cells:
        """Return the table of streams with two chunks of each."""
        table = np.zeros((len(self.chunks), COLUMNS["streams"]), dtype=np.int64)
        for row, chunks in zip(table, self.chunks, strict=True):
            row[FIRST_DRAW:] = np.concatenate([next(chunks), next(chunks)])
        return table
