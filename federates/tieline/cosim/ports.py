"""A block of loopback ports for each run, so that two runs at once never meet."""

import random
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from tieline.errors import CosimError

# Below 32768, where Linux begins to hand out ports on its own.
_BLOCKS = range(10_000, 32_600, 100)
_LOCK_OFFSET = 99
# The broker takes the first two, the cores the sixth and seventh; the rest is room.
_USED = 20
_HOST = "127.0.0.1"


@contextmanager
def reserved_port() -> Iterator[int]:
    """Give the first port of a free block of 100; the block stays reserved inside the context.

    HELICS cores bind ports next to their broker's, so that one free port is not enough. The
    block's last port is held bound: whoever else looks for a block sees that it is taken.

    Raises:
        CosimError: no block is free.
    """
    blocks = list(_BLOCKS)
    # Not the experiment's randomness: which ports a run uses must not touch its result.
    random.SystemRandom().shuffle(blocks)
    for first in blocks:
        lock = _bound(first + _LOCK_OFFSET)
        if lock is None:
            continue
        with lock:
            if all(_is_free(port) for port in range(first, first + _USED)):
                yield first
                return
    raise CosimError(
        f"no free block of ports between {_BLOCKS.start} and {_BLOCKS.stop} on {_HOST}: "
        "end some of the runs"
    )


def _bound(port: int) -> socket.socket | None:
    holder = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        holder.bind((_HOST, port))
    except OSError:
        holder.close()
        return None
    return holder


def _is_free(port: int) -> bool:
    holder = _bound(port)
    if holder is None:
        return False
    holder.close()
    return True
