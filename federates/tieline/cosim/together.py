"""Both federates in one process (cores inproc, local): `python -m tieline.cosim.together RUN.json`."""

import os
import sys
import threading
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.cosim.exchange import PEER
from tieline.cosim.federate import (
    Federate,
    OpenParticipant,
    end_process,
    exit_code_of,
    federation_of,
    read_run,
    reason_of,
)
from tieline.cosim.guard import GuardedParticipant
from tieline.cosim.interfaces import FEDERATES, GRID, NETWORK, Clock
from tieline.cosim.link import Broker
from tieline.cosim.local import run_local
from tieline.cosim.process import die_with_launcher, on_termination, signals_held
from tieline.cosim.status import Heartbeat, State, Status
from tieline.errors import CosimError

_STDOUT = 1
_STOP_S = 1.0
_SAVE_S = 2.0


def main(participants: Mapping[str, OpenParticipant] | None = None) -> None:
    """Run both federates of the run file that the first argument names; end with an exit code.

    Args:
        participants: what opens each federate's participant; tieline's own by default.

    Raises:
        SystemExit: always; 0 only when the federation reached its end.
    """
    die_with_launcher()
    run, folder = read_run(sys.argv)
    openers = participants or _own_participants()
    statuses = {name: Status(name, _STDOUT) for name in FEDERATES}
    runner = _InProcess if federation_of(run)[0].core == "inproc" else _Local
    both = runner(run, folder, statuses)
    on_termination(lambda name: _terminate(both, name))
    with Heartbeat(statuses.values()):
        code = both.serve(openers)
    end_process(code)


class _Local:
    """Both participants in turn, without HELICS."""

    def __init__(self, run: dict[str, Any], folder: Path, statuses: Mapping[str, Status]) -> None:
        self.is_done = threading.Event()
        self._run = run
        self._folder = folder
        self._statuses = statuses
        self._participants: dict[str, GuardedParticipant] = {}
        self._opening = GRID
        self._stop: str | None = None

    def serve(self, openers: Mapping[str, OpenParticipant]) -> int:
        """Return the exit code of the run."""
        try:
            self._take_part(openers)
        except Exception as error:
            return self._fail(error)
        finally:
            self.is_done.set()
        return 0

    def stop(self, reason: str) -> None:
        """Have both participants stop and save what they have, from another thread."""
        self._stop = reason
        for participant in self._participants.values():
            participant.stop(reason)
        if self.is_done.wait(_STOP_S):
            return
        for name, participant in self._participants.items():
            self._statuses[name].fail(reason, "own", CosimError.exit_code)
            participant.abort(reason, _SAVE_S)

    def _take_part(self, openers: Mapping[str, OpenParticipant]) -> None:
        for name in FEDERATES:
            self._opening = name
            self._statuses[name].enter("opening")
            self._participants[name] = GuardedParticipant(openers[name](self._run, self._folder))
            if self._stop is not None:
                raise CosimError(self._stop)
        self._enter_all("running")
        run_local(
            self._participants[GRID],
            self._participants[NETWORK],
            Clock(**self._run["clock"]),
            lambda name, k, granted_ns: self._statuses[name].grant(k, granted_ns),
        )
        self._enter_all("finished")

    def _fail(self, error: Exception) -> int:
        traceback.print_exception(error)
        reason = self._stop or reason_of(error)
        code = CosimError.exit_code if self._stop else exit_code_of(error)
        culprit = self._culprit()
        self._statuses[culprit].fail(reason, "own", code)
        self._statuses[PEER[culprit]].fail(f"{culprit}: {reason}", "other", code)
        for participant in self._participants.values():
            participant.abort(reason)
        return code

    def _culprit(self) -> str:
        for name, participant in self._participants.items():
            if participant.error is not None:
                return name
        return self._opening

    def _enter_all(self, state: State) -> None:
        for status in self._statuses.values():
            status.enter(state)


class _InProcess:
    """Both federates as HELICS federates on two threads, with a broker of the inproc core."""

    def __init__(self, run: dict[str, Any], folder: Path, statuses: Mapping[str, Status]) -> None:
        self.is_done = threading.Event()
        self._federates = [Federate(name, run, folder, statuses[name]) for name in FEDERATES]
        self._codes: list[int] = []

    def serve(self, openers: Mapping[str, OpenParticipant]) -> int:
        """Return the exit code of the run: that of the first federate that failed."""
        with signals_held():
            broker = Broker("inproc", None)
        threads = [
            threading.Thread(target=self._serve_one, args=(federate, openers[federate.name]))
            for federate in self._federates
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.is_done.set()
        broker.wait(_STOP_S)
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


def _own_participants() -> dict[str, OpenParticipant]:
    from tieline.grid.federate import open_participant as open_grid
    from tieline.network.federate import open_participant as open_network

    return {GRID: open_grid, NETWORK: open_network}


def _terminate(both: _Local | _InProcess, signal_name: str) -> None:
    both.stop(f"terminated by {signal_name}")
    if not both.is_done.wait(_STOP_S):
        os._exit(CosimError.exit_code)


if __name__ == "__main__":
    main()
