"""A participant that can be stopped and saved from another thread."""

import sys
import threading
import traceback
from collections.abc import Callable
from typing import TypeVar

from tieline.cosim.interfaces import Participant
from tieline.errors import CosimError

Result = TypeVar("Result")


class GuardedParticipant:
    """A participant behind a lock: one call at a time, none after a stop, and one abort at most.

    Attributes:
        name: the participant's.
        error: what the participant raised, None so far.
    """

    def __init__(self, participant: Participant) -> None:
        self.name = participant.name
        self.error: Exception | None = None
        self._participant = participant
        self._lock = threading.Lock()
        self._stop: str | None = None
        self._is_over = False

    def start(self) -> list[bytes]:
        """Return the participant's first messages."""
        return self._call(self._participant.start)

    def advance(self, k: int, received: bytes) -> bytes:
        """Return the participant's message after interval `k`."""
        return self._call(lambda: self._participant.advance(k, received))

    def finish(self) -> None:
        """Let the participant finish."""
        self._call(self._participant.finish)
        self._is_over = True

    def stop(self, reason: str) -> None:
        """Refuse every further call with `reason`; a call under way goes on."""
        self._stop = reason

    def abort(self, reason: str, wait_s: float = -1.0) -> None:
        """Have the participant save what it has, once, when no call is under way.

        Args:
            reason: why.
            wait_s: longest wait for a call under way, s; -1 waits without end.
        """
        if not self._lock.acquire(timeout=wait_s):
            sys.stderr.write(f"{self.name} is busy and could not be saved\n")
            return
        try:
            if not self._is_over:
                self._is_over = True
                self._participant.abort(reason)
        except Exception:
            # The failure that led here is what the run must report; this one goes to the log.
            traceback.print_exc()
        finally:
            self._lock.release()

    def _call(self, function: Callable[[], Result]) -> Result:
        with self._lock:
            if self._stop is not None:
                raise CosimError(self._stop)
            try:
                return function()
            except Exception as error:
                self.error = error
                raise
