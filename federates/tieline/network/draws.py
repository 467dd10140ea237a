"""Endless supplies of whole random numbers, in chunks of one size."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

Chunk = NDArray[np.int64]
Chunks = Iterator[Chunk]

CHUNK = 4096
"""Numbers of a chunk."""

NEVER = 1 << 60
"""A gap of 36 years, or of as many packets: what follows the last number of a finite supply."""


def chunked(parts: Iterable[Chunk], filling: int) -> Chunks:
    """Yield numbers that come in parts of any size in chunks of one, then `filling` for ever."""
    held = np.empty(0, dtype=np.int64)
    for part in parts:
        held = np.concatenate([held, part.astype(np.int64)])
        while len(held) >= CHUNK:
            yield held[:CHUNK]
            held = held[CHUNK:]
    last = np.full(CHUNK, filling, dtype=np.int64)
    last[: len(held)] = held
    yield last
    while True:
        yield np.full(CHUNK, filling, dtype=np.int64)
