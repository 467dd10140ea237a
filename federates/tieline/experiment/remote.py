"""What a launcher sees of a process on another host: the same as of a child of its own."""

import collections
from collections.abc import Iterator, Mapping
from typing import Any

from tieline.cosim.interfaces import FEDERATES
from tieline.errors import CosimError
from tieline.experiment.desk import Wire
from tieline.experiment.watch import Suspect

INTERRUPTED = "it was interrupted there"


class _Tail:
    """The last words of a log that is on the other host."""

    def __init__(self) -> None:
        self.tail: collections.deque[str] = collections.deque(maxlen=0)


class Remote:
    """A federate on another host, as the broker's launcher sees it.

    Attributes:
        exit_code: None while it runs.
        reason: why it is gone, where there is more to say than its exit code.
    """

    def __init__(self, name: str, wire: Wire) -> None:
        self.name = name
        self.exit_code: int | None = None
        self.reason: str | None = None
        self.use = None
        self.log = _Tail()
        self._has_finished = False
        self._wire = wire

    @property
    def descriptors(self) -> tuple[int, ...]:
        """What to wait for."""
        return () if self._wire.lost else (self._wire.fileno(),)

    def read(self) -> Iterator[dict[str, Any]]:
        """Yield what the federate says of itself."""
        for message in self._wire.read():
            if "federate" in message:
                self._has_finished = message.get("state") == "finished"
                yield message
            elif message:
                self.take(message)

    def take(self, message: Mapping[str, Any]) -> None:
        """Take in that the federate has ended."""
        if "done" in message:
            self.exit_code = int(message["done"])
            self.reason = message.get("reason")

    def poll(self) -> bool:
        """Return whether it has ended, or is out of reach."""
        self._wire.keep_alive()
        if self.exit_code is None and self._wire.lost:
            self.exit_code, self.reason = CosimError.exit_code, f"gone: {self._wire.lost}"
        return self.exit_code is not None

    def is_stopped(self) -> bool:
        """Return False: nobody looks from here."""
        return False

    def effort(self) -> None:
        """Return None: nobody looks from here."""

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send it a message."""
        self._wire.send(message)

    def terminate(self) -> None:
        """Have it end; it saves what it has. One that has finished is about to end by itself."""
        if not self.poll() and not self._has_finished:
            self.tell({"end": f"broker: {INTERRUPTED}"})

    def kill(self) -> None:
        """Give it up; one that has finished has written all that it had to."""
        if self.exit_code is None and self._has_finished:
            self.exit_code = 0
        elif self.exit_code is None:
            self.exit_code, self.reason = CosimError.exit_code, "it did not end in time"

    def close(self) -> None:
        """Leave the connection to whoever made it; a last word may still be due."""


class Uplink(Remote):
    """The broker, as the launcher of a single federate sees it.

    Its exit code is 0 as long as all is well: nobody waits for it.
    """

    def __init__(self, wire: Wire) -> None:
        super().__init__("broker", wire)
        self.exit_code = 0

    def take(self, message: Mapping[str, Any]) -> None:
        """Take in that the run ends, well or badly."""
        if "end" in message and self.exit_code == 0:
            self.exit_code, self.reason = CosimError.exit_code, str(message["end"])

    def poll(self) -> bool:
        """Return True; note when the broker is out of reach."""
        self._wire.keep_alive()
        if self.exit_code == 0 and self._wire.lost:
            self.exit_code, self.reason = CosimError.exit_code, f"gone: {self._wire.lost}"
        return True

    def end(self, suspect: Suspect) -> None:
        """Tell that the federate here ends early, and why."""
        self.tell({"done": suspect.exit_code, "reason": suspect.reason})

    def hear(self, message: Mapping[str, Any]) -> None:
        """Pass on what the federate here says of itself."""
        if message.get("federate") in FEDERATES:
            self.tell(message)
