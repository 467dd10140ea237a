"""Both federates in one process (inproc or local): `python -m tieline.cosim.together RUN.json`."""

import os
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from tieline.cosim.exchange import PEER
from tieline.cosim.guard import GuardedParticipant
from tieline.cosim.interfaces import FEDERATES, GRID, NETWORK, Clock, OpenParticipant
from tieline.cosim.journal import keep_journal, log_failure
from tieline.cosim.local import run_local
from tieline.cosim.process import (
    die_with_launcher,
    end_process,
    exit_code_of,
    on_termination,
    reason_of,
)
from tieline.cosim.runfile import federation_of, read_run
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
    keep_journal("together", tuple(statuses.values()), _STDOUT)
    both = _both(run, folder, statuses)
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
        culprit = self._culprit()
        log_failure(culprit, error)
        reason = self._stop or reason_of(error)
        code = CosimError.exit_code if self._stop else exit_code_of(error)
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


class _Both(Protocol):
    is_done: threading.Event

    def serve(self, openers: Mapping[str, OpenParticipant]) -> int: ...

    def stop(self, reason: str) -> None: ...


def _both(run: dict[str, Any], folder: Path, statuses: Mapping[str, Status]) -> _Both:
    if federation_of(run)[0].core == "local":
        return _Local(run, folder, statuses)
    # Imported here so that a local run needs no HELICS at all.
    from tieline.cosim.inproc import InProcess

    return InProcess(run, folder, statuses)


def _own_participants() -> dict[str, OpenParticipant]:
    from tieline.grid.federate import open_participant as open_grid
    from tieline.network.federate import open_participant as open_network

    return {GRID: open_grid, NETWORK: open_network}


def _terminate(both: _Both, signal_name: str) -> None:
    both.stop(f"terminated by {signal_name}")
    if not both.is_done.wait(_STOP_S):
        os._exit(CosimError.exit_code)


if __name__ == "__main__":
    main()
