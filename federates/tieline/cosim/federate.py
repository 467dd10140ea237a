"""One federate as a process: opens its participant, joins the federation and ends with a code."""

import json
import os
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tieline.cosim.exchange import SIDES, Exchange
from tieline.cosim.guard import GuardedParticipant
from tieline.cosim.interfaces import Clock, FederationSettings, Participant
from tieline.cosim.link import FederationEndedError, HelicsLink
from tieline.cosim.process import die_with_launcher, on_termination, signals_held
from tieline.cosim.status import Fault, Heartbeat, Status
from tieline.errors import CosimError, InputError, TielineError

OpenParticipant = Callable[[dict[str, Any], Path], Participant]

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
    """

    def __init__(self, name: str, run: dict[str, Any], folder: Path, status: Status) -> None:
        self.name = name
        self.is_done = threading.Event()
        self._run = run
        self._folder = folder
        self._status = status
        self._participant: GuardedParticipant | None = None
        self._link: HelicsLink | None = None
        self._stop: tuple[str, Fault] | None = None

    def serve(self, open_participant: OpenParticipant) -> int:
        """Return the exit code of a whole run, 0 only when it reached its checked end."""
        try:
            self._take_part(open_participant)
        except Exception as error:
            return self._fail(error)
        finally:
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
        settings, port = federation_of(self._run)
        self._status.enter("opening")
        participant = GuardedParticipant(open_participant(self._run, self._folder))
        self._participant = participant
        self._status.enter("joining")
        with signals_held():
            link = HelicsLink(self.name, settings.core, port, settings.start_timeout)
            self._link = link
        if self._stop is not None:
            raise CosimError(self._stop[0])
        link.start()
        self._status.enter("running")
        SIDES[self.name](participant, Exchange(self.name, link, clock, self._status), clock)
        self._status.enter("finishing")
        link.leave()
        participant.finish()
        self._status.enter("finished")

    def _fail(self, error: Exception) -> int:
        traceback.print_exception(error)
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
    federate = Federate(name, run, folder, status)
    on_termination(lambda signal_name: _terminate(federate, signal_name))
    with Heartbeat([status]):
        code = federate.serve(open_participant)
    end_process(code)


def read_run(argv: list[str]) -> tuple[dict[str, Any], Path]:
    """Return the run file's content and its folder.

    Raises:
        SystemExit: there is no such argument or file, or it is no JSON.
    """
    try:
        if len(argv) != 2:
            raise InputError(
                f"usage: {Path(argv[0]).name} RUN.json (got {len(argv) - 1} arguments)"
            )
        path = Path(argv[1])
        return json.loads(path.read_text(encoding="utf-8")), path.resolve().parent
    except (InputError, OSError, json.JSONDecodeError) as error:
        sys.stderr.write(f"cannot read the run file: {error}\n")
        raise SystemExit(InputError.exit_code) from error


def federation_of(run: dict[str, Any]) -> tuple[FederationSettings, int | None]:
    """Return a run's federation settings and its broker's port."""
    stated = dict(run["federation"])
    port = stated.pop("broker_port", None)
    return FederationSettings(**stated), port


def reason_of(error: BaseException) -> str:
    """Return a failure's message, with its class where it is none of tieline's."""
    if isinstance(error, TielineError):
        return str(error)
    return f"{type(error).__name__}: {error}"


def exit_code_of(error: BaseException) -> int:
    """Return the exit code that stands for an exception."""
    return error.exit_code if isinstance(error, TielineError) else TielineError.exit_code


def end_process(code: int) -> None:
    """End this process.

    After a failure it ends at once: HELICS waits for lost peers in its own clean-up.

    Raises:
        SystemExit: the code is 0.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    if code:
        os._exit(code)
    raise SystemExit(0)


def _verdict(error: Exception) -> tuple[str, Fault]:
    return reason_of(error), "other" if isinstance(error, FederationEndedError) else "own"


def _terminate(federate: Federate, signal_name: str) -> None:
    federate.interrupt(f"terminated by {signal_name}", "own")
    federate.save()
    if not federate.is_done.is_set():
        os._exit(CosimError.exit_code)
