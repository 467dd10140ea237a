"""A lock between processes, so that two that need the same function do not both compile it."""

import fcntl
import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

POLL_S = 0.01
"""Short enough that the time it takes shows whoever watches this process that it lives."""

PATIENCE_S = 300.0
"""After so long whoever holds the lock may have been stopped: then both compile."""


class Lock:
    """A file that one process at a time holds; it is given up when that process ends."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._descriptor: int | None = None

    def acquire(self, is_needless: Callable[[], bool]) -> bool:
        """Wait for the lock and return whether it is held.

        Args:
            is_needless: says whether what the lock is for has been done meanwhile.
        """
        try:
            descriptor = os.open(self._path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        except OSError:
            return False
        limit = time.monotonic() + PATIENCE_S
        while not is_needless() and time.monotonic() < limit:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                time.sleep(POLL_S)
                continue
            self._descriptor = descriptor
            return True
        os.close(descriptor)
        return False

    def release(self) -> None:
        """Give it up, and remove its file."""
        if self._descriptor is not None:
            with suppress(OSError):
                self._path.unlink()
            os.close(self._descriptor)
            self._descriptor = None
