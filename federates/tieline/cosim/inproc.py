"""Both federates as HELICS federates on two threads of one process."""

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.cosim.conventions import Place
from tieline.cosim.federate import Federate
from tieline.cosim.interfaces import FEDERATES, OpenParticipant
from tieline.cosim.link import Broker
from tieline.cosim.process import signals_held
from tieline.cosim.status import Status

_END_S = 1.0


class InProcess:
    """Both federates as HELICS federates on two threads, with a broker of the inproc core."""

    def __init__(self, run: dict[str, Any], folder: Path, statuses: Mapping[str, Status]) -> None:
        self.is_done = threading.Event()
        self._federates = [Federate(name, run, folder, statuses[name]) for name in FEDERATES]
        self._codes: list[int] = []

    def serve(self, openers: Mapping[str, OpenParticipant]) -> int:
        """Return the exit code of the run: that of the first federate that failed."""
        with signals_held():
            broker = Broker(Place("inproc"), len(FEDERATES))
        threads = [
            threading.Thread(target=self._serve_one, args=(federate, openers[federate.name]))
            for federate in self._federates
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.is_done.set()
        broker.wait(_END_S)
        return next((code for code in self._codes if code), 0)

    def stop(self, reason: str) -> None:
        """End the federation from another thread and wait until both participants are saved."""
        for federate in self._federates:
            federate.interrupt(reason, "own")
        for federate in self._federates:
            federate.save()

    def _serve_one(self, federate: Federate, opener: OpenParticipant) -> None:
        code = federate.serve(opener)
        self._codes.append(code)
        if code:
            # One that failed before it joined left no word in HELICS, where the other may wait.
            for other in self._federates:
                other.interrupt(f"{federate.name} failed", "other")
