"""One federate as a process: opens its participant, joins the federation and ends with a code."""

import os
import sys
import threading
from pathlib import Path
from typing import Any

from tieline.cosim.conventions import member_count, own_config
from tieline.cosim.desks import desk_of
from tieline.cosim.exchange import SIDES, Exchange
from tieline.cosim.guard import GuardedParticipant
from tieline.cosim.interfaces import Clock, OpenParticipant
from tieline.cosim.journal import keep_journal, log_failure
from tieline.cosim.link import FederationEndedError, HelicsLink
from tieline.cosim.process import (
    die_with_launcher,
    end_process,
    exit_code_of,
    on_termination,
    reason_of,
    signals_held,
)
from tieline.cosim.runfile import federation_of, read_config, read_run
from tieline.cosim.status import Fault, Heartbeat, Status
from tieline.cosim.strangers import Strangers
from tieline.cosim.word import leave_word
from tieline.errors import CosimError

_STDOUT = 1
_TELL_S = 1.0
_STOP_S = 1.0
_SAVE_S = 2.0


class Federate:
    """One federate from the opening of its participant to the end of the federation.

    Args:
        name: `grid` or `network`.
        run: the run file's content.
        folder: the run folder.
        status: where it says how it is.
        config: its HELICS configuration; None for that of the run.
    """

    def __init__(
        self,
        name: str,
        run: dict[str, Any],
        folder: Path,
        status: Status,
        config: dict[str, Any] | None = None,
    ) -> None:
        self.name = name
        self.is_done = threading.Event()
        self._config = config
        self._run = run
        self._folder = folder
        self._status = status
        self._participant: GuardedParticipant | None = None
        self._link: HelicsLink | None = None
        self._stop: tuple[str, Fault] | None = None
        self._strangers = Strangers(name)

    def serve(self, open_participant: OpenParticipant) -> int:
        """Return the exit code of a whole run, 0 only when it reached its checked end."""
        try:
            self._take_part(open_participant)
        except Exception as error:
            return self._fail(error)
        finally:
            self._strangers.save(self._folder)
            self.is_done.set()
        return 0

    def interrupt(self, reason: str, fault: Fault) -> None:
        """Have this federate end, from another thread, as soon as it waits or begins a call."""
        if self._stop is None:
            self._stop = (reason, fault)
        if self._participant is not None:
            self._participant.stop(reason)
        if self._link is not None:
            self._link.fail(f"{self.name}: {reason}")

    def save(self) -> None:
        """Wait until an interrupted federate has ended; save its participant if it does not."""
        if self._stop is None or self.is_done.wait(_STOP_S):
            return
        reason, fault = self._stop
        self._status.fail(reason, fault, CosimError.exit_code)
        if self._participant is not None:
            self._participant.abort(reason, _SAVE_S)

    def _take_part(self, open_participant: OpenParticipant) -> None:
        clock = Clock(**self._run["clock"])
        settings, place = federation_of(self._run)
        self._status.enter("opening")
        opened = open_participant(self._run, self._folder)
        desk = desk_of(opened, self._run)
        participant = GuardedParticipant(desk or opened)
        self._participant = participant
        self._status.enter("joining")
        config = self._config or own_config(self.name, self._run, place, settings.start_timeout)
        with signals_held():
            members = member_count(self._run)
            link = HelicsLink(self.name, config, members, self._strangers)
            self._link = link
        if self._stop is not None:
            raise CosimError(self._stop[0])
        if desk is not None:
            desk.open(link, self._strangers)
        link.start()
        self._status.enter("running")
        SIDES[self.name](participant, Exchange(self.name, link, clock, self._status), clock)
        self._status.enter("finishing")
        link.leave()
        participant.finish()
        self._status.enter("finished")

    def _fail(self, error: Exception) -> int:
        log_failure(self.name, error)
        reason, fault = self._stop or _verdict(error)
        code = CosimError.exit_code if self._stop else exit_code_of(error)
        self._status.fail(reason, fault, code)
        if fault == "own" and self._link is not None:
            self._link.fail(f"{self.name}: {reason}")
        if self._participant is not None:
            self._participant.abort(reason)
        if fault == "own" and self._link is not None:
            self._link.flush(_TELL_S)
        return code


def main(name: str, open_participant: OpenParticipant) -> None:
    """Run one federate of the run file that the first argument names; end with its exit code.

    Args:
        name: `grid` or `network`.
        open_participant: makes the participant from the run file's content and the run folder.

    Raises:
        SystemExit: always; 0 only when the federation reached its end.
    """
    die_with_launcher()
    run, folder = read_run(sys.argv)
    status = Status(name, _STDOUT)
    keep_journal(name, [status], _STDOUT)
    federate = Federate(name, run, folder, status, read_config(sys.argv))
    on_termination(lambda signal_name: _terminate(federate, signal_name))
    with Heartbeat([status]):
        code = federate.serve(open_participant)
    if run.get("leaves_word"):
        leave_word(folder, status, code)
    end_process(code)


def _verdict(error: Exception) -> tuple[str, Fault]:
    return reason_of(error), "other" if isinstance(error, FederationEndedError) else "own"


def _terminate(federate: Federate, signal_name: str) -> None:
    federate.interrupt(f"terminated by {signal_name}", "own")
    federate.save()
    if not federate.is_done.is_set():
        os._exit(CosimError.exit_code)
