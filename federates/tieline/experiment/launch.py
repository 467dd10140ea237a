"""Starts the processes of one run, watches them, and ends every one of them at the first fault."""

import json
import selectors
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from tieline.cosim.conventions import member_count
from tieline.cosim.interfaces import FEDERATES, GRID, NETWORK
from tieline.cosim.ports import reserved_port
from tieline.cosim.runfile import federation_of
from tieline.errors import CosimError, TielineError
from tieline.experiment.folder import write_json
from tieline.experiment.guests import GuestProcess, guest_processes
from tieline.experiment.interrupts import current_interrupts, interruptible
from tieline.experiment.keys import keyed, new_key
from tieline.experiment.remote import Remote
from tieline.experiment.run_logs import RunLogs
from tieline.experiment.strays import end_strays
from tieline.experiment.supervise import Child, ProcessUse, Start, end_all, executed
from tieline.experiment.watch import Progress, Suspect, Watch

BROKER = "broker"
TOGETHER = "together"

COMMANDS: Mapping[str, Sequence[str]] = {
    BROKER: (sys.executable, "-m", "tieline.cosim.broker"),
    GRID: (sys.executable, "-m", "tieline.grid"),
    NETWORK: (sys.executable, "-m", "tieline.network"),
    TOGETHER: (sys.executable, "-m", "tieline.cosim.together"),
}
"""What starts each process; the run file follows as argument, or core and port for the broker."""

_POLL_S = 0.1
_SETTLE_S = 0.6
_LINGER_S = 2.0
_END_WITHIN_S = 7.5
_LEAST_GRACE_S = 1.0
_MOST_GRACE_S = 3.0


@dataclass(frozen=True)
class Outcome:
    """How a run went.

    Attributes:
        wall_s: wall time of the phases `start` (until every federate has joined), `run` and `end`.
        granted_ns: last time granted to each federate, -1 for none.
        processes: what each process cost, as far as it had ended by itself or was ended.
    """

    wall_s: dict[str, float]
    granted_ns: dict[str, int]
    processes: tuple[ProcessUse, ...]


class FederateFailedError(CosimError):
    """A run ended early.

    Attributes:
        federate: the name of the process or federate at fault.
        outcome: how far the run came.
        exit_code: that of the federate's own exception where it had one.
    """

    def __init__(self, suspect: Suspect, outcome: Outcome, tail: Sequence[str]) -> None:
        lines = [f"{suspect.name}: {suspect.reason}", *(f"  | {line}" for line in tail)]
        super().__init__("\n".join(lines))
        self.federate = suspect.name
        self.reason = suspect.reason
        self.outcome = outcome
        self.exit_code = suspect.exit_code


def launch(
    folder: Path,
    on_progress: Callable[[Progress], None] | None = None,
    *,
    commands: Mapping[str, Sequence[str]] | None = None,
    order: Sequence[str] = FEDERATES,
    stagger_s: float = 0.0,
    start: Start = executed,
) -> Outcome:
    """Run the federation of `folder/run.json` to its end and return how it went.

    Args:
        folder: the run folder; logs go to its `logs/`, the broker's port into its run.json.
        on_progress: called with every word of a federate about itself.
        commands: replaces entries of `COMMANDS`.
        order: which federate is started first.
        stagger_s: wall time between the two starts, s.
        start: how each process comes to be.

    Raises:
        FederateFailedError: a process died, failed, hung or never joined; every process is ended by
            then, and what was written is readable.
        KeyboardInterrupt: the user ended the run; the same holds.
    """
    run_file = folder / "run.json"
    run = json.loads(run_file.read_text(encoding="utf-8"))
    settings, _ = federation_of(run)
    table = {**COMMANDS, **(commands or {})}
    with ExitStack() as stack:
        stack.enter_context(interruptible())
        if settings.core in ("inproc", "local"):
            starts = [(TOGETHER, [*table[TOGETHER], str(run_file)])]
        else:
            port = stack.enter_context(reserved_port())
            _write_port(run_file, run, port)
            members = f"--federates={member_count(run)}"
            broker = [*table[BROKER], settings.core, str(port), members]
            starts = [(BROKER, broker), *((name, [*table[name], str(run_file)]) for name in order)]
        guests = guest_processes(run, folder)
        watch, key = Watch(settings), new_key()
        processes = Processes(folder, watch, on_progress, guests, start=start, key=key)
        return processes.run(starts, stagger_s)


class Processes:
    """The processes of one run and what is known of them.

    Args:
        folder: the run folder.
        watch: judges them.
        on_progress: called with every word of a federate about itself.
        guests: started once the federates are ready to join.
        remotes: processes of other hosts.
        on_fault: told who is at fault, or that the user is, before everything is ended.
        on_word: given every word as it came.
        start: how a federate or the broker comes to be.
        key: HELICS's, without which nobody joins; None asks for none.
        name: of this launcher's own log.
    """

    def __init__(
        self,
        folder: Path,
        watch: Watch,
        on_progress: Callable[[Progress], None] | None,
        guests: Sequence[GuestProcess] = (),
        *,
        remotes: Sequence[Remote] = (),
        on_fault: Callable[[Suspect], None] | None = None,
        on_word: Callable[[Mapping[str, Any]], None] | None = None,
        start: Start = executed,
        key: str | None = None,
        name: str = "launcher",
    ) -> None:
        self._folder = folder
        self._logs = RunLogs(folder, watch, name)
        self._on_progress = on_progress
        self._watch = watch
        self._guests = list(guests)
        self._has_guests = bool(guests)
        self._on_fault = on_fault
        self._on_word = on_word
        self._start_process = start
        self._key = key
        self._interrupts = current_interrupts()
        self._children: dict[str, Child | Remote] = {remote.name: remote for remote in remotes}
        self._marks: dict[str, float] = {}

    def run(self, starts: Sequence[tuple[str, list[str]]], stagger_s: float = 0.0) -> Outcome:
        """Return the outcome once every process has ended well."""
        self._marks["start"] = time.monotonic()
        try:
            self._start(starts, stagger_s)
            self._follow()
            self._logs.ended()
        except BaseException as error:
            with self._interrupts.hold():
                self._logs.failed(error)
                if isinstance(error, KeyboardInterrupt) and self._on_fault is not None:
                    self._on_fault(Suspect(starts[0][0], "interrupted", CosimError.exit_code))
                self._end()
                self._salvage(error)
                if isinstance(error, KeyboardInterrupt):
                    error.outcome = self._outcome()  # type: ignore[attr-defined]
            raise
        finally:
            self._logs.close()
        return self._outcome()

    def _start(self, starts: Sequence[tuple[str, list[str]]], stagger_s: float) -> None:
        for name, command in starts:
            if name in FEDERATES and any(other in FEDERATES for other in self._children):
                time.sleep(stagger_s)
            self._start_one(name, command, self._start_process, has_word=True)

    def _start_one(
        self, name: str, command: Sequence[str], start: Start, *, has_word: bool
    ) -> None:
        try:
            log = self._logs.of(name)
            keyed_start = keyed(start, self._key)
            child = Child(name, command, log, keyed_start, has_word, self._folder)
        except OSError as error:
            self._fail(Suspect(name, f"could not be started: {error}", CosimError.exit_code))
        self._children[name] = child
        self._logs.started(child, command)

    def _start_guests(self) -> None:
        """Start the guests once the federates are opened, so that none waits for a compiler."""
        while self._guests and self._watch.is_opened():
            guest = self._guests.pop()
            start = partial(executed, directory=guest.directory)
            # What a guest prints is no word of a federate about itself.
            self._start_one(guest.name, guest.command, start, has_word=False)

    def _follow(self) -> None:
        before_s = time.monotonic()
        while any(child.exit_code is None for child in self._children.values()):
            self._wait()
            self._interrupts.insist()
            self._start_guests()
            now_s = time.monotonic()
            self._watch.pass_time(now_s - before_s)
            before_s = now_s
            if self._watch.is_running():
                self._marks.setdefault("run", now_s)
            if self._watch.is_finished():
                self._marks.setdefault("end", now_s)
            self._judge()
            if self._watch.is_finished() and self._watch.silence_s > _LINGER_S:
                break
        self._end()

    def _wait(self) -> None:
        with selectors.DefaultSelector() as selector:
            for child in self._children.values():
                for descriptor in child.descriptors:
                    selector.register(descriptor, selectors.EVENT_READ)
            selector.select(_POLL_S)
        # In this order: what the dead have said is then known before they are judged.
        for child in self._children.values():
            child.poll()
        self._hear()

    def _hear(self) -> None:
        for child in self._children.values():
            for message in child.read():
                self._logs.hear(message)
                if self._on_word is not None:
                    self._on_word(message)
                progress = self._watch.hear(message)
                if progress is not None and self._on_progress is not None:
                    self._on_progress(progress)

    def _judge(self) -> None:
        suspect = self._watch.suspect(self._children)
        if suspect is None:
            return
        limit = time.monotonic() + _SETTLE_S
        # The first sign is often the victim's: the culprit's own word or death follows it.
        while not suspect.is_certain and time.monotonic() < limit:
            self._wait()
            suspect = self._watch.suspect(self._children)
            if suspect is None:
                return
        self._fail(suspect)

    def _fail(self, suspect: Suspect) -> NoReturn:
        self._logs.fault(suspect)
        if self._on_fault is not None:
            self._on_fault(suspect)
        self._end()
        child = self._children.get(suspect.name, self._children.get(TOGETHER))
        tail = () if child is None else tuple(child.log.tail)
        raise FederateFailedError(suspect, self._outcome(), tail)

    def _end(self) -> None:
        children = tuple(self._children.values())
        left_s = _END_WITHIN_S - self._watch.silence_s
        grace_s = min(_MOST_GRACE_S, max(_LEAST_GRACE_S, left_s))
        end_all(children, grace_s, lambda: self._interrupts.is_hurried)
        if self._has_guests:
            # A guest's own children may have left its group.
            end_strays(str(self._folder.resolve()))
        self._hear()
        for child in children:
            child.close()
            self._logs.used(child.use)

    def _outcome(self) -> Outcome:
        uses = (child.use for child in self._children.values())
        return Outcome(
            self._phases_s(),
            self._watch.granted_ns(),
            tuple(use for use in uses if use is not None),
        )

    def _phases_s(self) -> dict[str, float]:
        instants = [*self._marks.values(), time.monotonic()]
        return {phase: instants[i + 1] - instants[i] for i, phase in enumerate(self._marks)}

    def _salvage(self, error: BaseException) -> None:
        from tieline.tables import salvage

        try:
            salvage(self._folder)
        except (TielineError, OSError) as second:
            error.add_note(f"what was written could not be made readable: {second}")


def _write_port(run_file: Path, run: dict[str, Any], port: int) -> None:
    run["federation"] = {**run["federation"], "broker_port": port}
    write_json(run_file, run)
