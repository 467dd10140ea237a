"""Tells from the federates' words and their processes' state who, if anyone, is at fault."""

import signal
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from tieline.cosim.interfaces import FEDERATES, FederationSettings
from tieline.errors import CosimError
from tieline.units import ns_to_seconds

STOPPED_S = 3.0
"""Longest silence while a process is held by a signal: nobody computes like that."""
PATIENCE = 5.0
"""How many times the longest meeting so far the next one may take, if somebody works on it."""
PATIENCE_FIRST = 2.0
"""The same for the first meeting, which may have compiled."""
LONG_S = 600.0
"""The same, where a federate may rightly work for long before there is a meeting to learn from."""

_FIRST_LOOK = 0.4
_WORKING_SHARE = 0.05
_LONGEST_PASS_S = 0.5
_LEAST_CPU_S = 0.05
_DONE = ("finished", "failed")
_STATES = ("starting", "opening", "joining", "running", "finishing", *_DONE)
_JOINING = _STATES.index("joining")


@dataclass(frozen=True)
class Progress:
    """One word of a federate: its state, the interval `k` and time of its last grant (-1: none)."""

    federate: str
    state: str
    k: int
    granted_ns: int


@dataclass(frozen=True)
class Suspect:
    """Who is at fault and why; not certain while the sign may be another's doing."""

    name: str
    reason: str
    exit_code: int
    is_certain: bool = True


@dataclass(frozen=True)
class Effort:
    """What a process has done since it began: processor time, s, and bytes from and to disks."""

    cpu_s: float
    disk_bytes: int


class Process(Protocol):
    """What is looked at of a process; `reason` may say more than its exit code does."""

    exit_code: int | None
    reason: str | None

    def is_stopped(self) -> bool:
        """Return whether a signal holds it."""

    def effort(self) -> Effort | None:
        """Return what it has done; None if that is not known."""


class Watch:
    """What is known of the federates, and for how long none of them has come further.

    Coming further is a new state or a new grant. Where a federate may rightly work for long
    without either (opening its participant, its first interval, when code is compiled, and
    writing its results) its processor time counts, too.

    How long a silence may last depends on what the federates' processes do in it. If none of them
    works, `hang_timeout` is the limit in any phase. If one does, the run's own longest meeting so
    far sets it, times `PATIENCE`, where that is longer; before there is one, and while results are
    written, `LONG_S` does. Once all have joined, guests may wait for something outside: how much
    they work is no sign then. Before, all that they have to do is to join.

    Args:
        settings: of the federation.
        members: the federates that it hears.
        bystanders: processes that may end before the run does.

    Attributes:
        silence_s: wall time since any federate came further, s.
    """

    def __init__(
        self,
        settings: FederationSettings,
        members: Sequence[str] = FEDERATES,
        bystanders: Sequence[str] = (),
    ) -> None:
        self.silence_s = 0.0
        self._members = tuple(members)
        self._settings = settings
        self._guests = tuple(guest.name for guest in settings.guests)
        self._bystanders = (*self._guests, *bystanders)
        self._last: dict[str, dict[str, Any]] = {}
        self._cpu_s: dict[str, float] = {}
        self._learned_s = 0.0
        self._meeting_s = 0.0
        self._efforts: tuple[float, dict[str, Effort]] | None = None
        self._works_on: bool | None = None
        self._guests_work: bool | None = None

    def hear(self, message: Mapping[str, Any]) -> Progress | None:
        """Take one word in; return it as progress, or None when it is not a federate's."""
        name = str(message.get("federate"))
        before = self._last.get(name, {})
        self._last[name] = dict(message)
        if _place(message) != _place(before):
            if self.is_running() and before.get("state") == message.get("state"):
                patience = PATIENCE if before.get("k", -1) > 0 else PATIENCE_FIRST
                self._learned_s = max(self._learned_s, patience * self._meeting_s)
            self._meeting_s = 0.0
            self._break_silence(name, message)
        elif self._works(name, message):
            self._break_silence(name, message)
        if name not in self._members:
            return None
        return Progress(name, message["state"], message["k"], message["granted_ns"])

    def pass_time(self, elapsed_s: float) -> None:
        """Let wall time pass; a launcher that was itself held for long counts little of it."""
        passed_s = min(elapsed_s, _LONGEST_PASS_S)
        self.silence_s += passed_s
        self._meeting_s += passed_s

    def granted_ns(self) -> dict[str, int]:
        """Return the last time granted to each federate, -1 for none."""
        return {name: self._last.get(name, {}).get("granted_ns", -1) for name in self._members}

    def is_running(self) -> bool:
        """Return whether every federate has joined."""
        return all(self._state(name) in ("running", "finishing", *_DONE) for name in self._members)

    def is_opened(self) -> bool:
        """Return whether every federate is ready to join."""
        return all(_STATES.index(self._state(name)) >= _JOINING for name in self._members)

    def is_finished(self) -> bool:
        """Return whether every federate has reached its end."""
        return all(self._state(name) == "finished" for name in self._members)

    def suspect(self, processes: Mapping[str, Process]) -> Suspect | None:
        """Return who is at fault so far, the surest sign first."""
        self._look_for_work(processes)
        return (
            self._failed_by_itself()
            or self._dead(processes)
            or self._stopped(processes)
            or self._ended_too_soon(processes)
            or self._failed_by_others()
            or self._silent(processes)
        )

    def _state(self, name: str) -> str:
        return str(self._last.get(name, {}).get("state", "starting"))

    def _break_silence(self, name: str, message: Mapping[str, Any]) -> None:
        self._cpu_s[name] = _cpu_s(message)
        self.silence_s = 0.0
        self._efforts = None
        self._works_on = self._guests_work = None

    def _look_for_work(self, processes: Mapping[str, Process]) -> None:
        """Compare what the federates' processes have done over half the limit, before it is up."""
        limit_s = self._settings.hang_timeout
        if self.silence_s < _FIRST_LOOK * limit_s:
            return
        now = {
            name: effort
            for name, process in processes.items()
            if (effort := process.effort()) is not None
        }
        if self._efforts is None:
            self._efforts = (self.silence_s, now)
            return
        since_s, before = self._efforts
        elapsed_s = self.silence_s - since_s
        if elapsed_s < limit_s / 2:
            return
        done = {
            name: Effort(
                now[name].cpu_s - before[name].cpu_s,
                now[name].disk_bytes - before[name].disk_bytes,
            )
            for name in before.keys() & now.keys()
        }
        alive = {name for name, process in processes.items() if process.exit_code is None}
        # One that died, or is on another host, may have worked: then nobody is called idle.
        known = {name for name in alive | before.keys() if name in done}
        unknown = (alive | before.keys()) - known
        guests = set(self._guests)
        # Whoever waits in HELICS for the others to join looks around all the time, and works not.
        waiting = set() if self.is_running() else {n for n in known if self._has_joined(n)}
        self._works_on = _have_worked(done, known - guests - waiting, unknown - guests, elapsed_s)
        self._guests_work = _have_worked(done, known & guests, unknown & guests, elapsed_s)
        self._efforts = (self.silence_s, now)

    def _works(self, name: str, message: Mapping[str, Any]) -> bool:
        may_be_long = message["state"] in ("opening", "finishing") or message.get("k") == 0
        return may_be_long and _cpu_s(message) - self._cpu_s[name] >= _LEAST_CPU_S

    def _failed_by_itself(self) -> Suspect | None:
        for name in self._members:
            if self._state(name) == "failed" and self._last[name]["fault"] == "own":
                return self._by_own_word(name, is_certain=True)
        return None

    def _dead(self, processes: Mapping[str, Process]) -> Suspect | None:
        for name, process in processes.items():
            if process.exit_code and not self._has_failed(name):
                manner = process.reason or f"died: {_manner(process.exit_code)}"
                reason = f"{manner}{self._when(name)}"
                return Suspect(name, reason, CosimError.exit_code)
        return None

    def _stopped(self, processes: Mapping[str, Process]) -> Suspect | None:
        limit_s = min(STOPPED_S, self._limit()[0])
        is_due = self.silence_s > limit_s or any(self._has_failed(name) for name in self._members)
        for name, process in processes.items():
            if is_due and process.is_stopped():
                reason = f"hung: its process is stopped by a signal{self._when(name)}"
                return Suspect(name, reason, CosimError.exit_code)
        return None

    def _ended_too_soon(self, processes: Mapping[str, Process]) -> Suspect | None:
        for name, process in processes.items():
            if name in self._bystanders:
                continue
            # A broker ends as soon as the federates have left, while they write their results.
            good = _DONE if name in self._members else ("finishing", *_DONE)
            states = [self._state(member) for member in self._whose(name)]
            if process.exit_code is not None and any(state not in good for state in states):
                reason = f"ended before the run did{self._when(name)}"
                return Suspect(name, reason, CosimError.exit_code, is_certain=name in self._members)
        return None

    def _failed_by_others(self) -> Suspect | None:
        for name in self._members:
            if self._state(name) == "failed":
                return self._by_own_word(name, is_certain=False)
        return None

    def _by_own_word(self, name: str, is_certain: bool) -> Suspect:
        word = self._last[name]
        reason = f"{word['reason']}{self._when(name)}"
        return Suspect(name, reason, int(word["exit_code"]), is_certain)

    def _silent(self, processes: Mapping[str, Process]) -> Suspect | None:
        limit_s, what = self._limit()
        if self.silence_s <= limit_s or self.is_finished():
            return None
        guests = [
            name for name in self._guests if name in processes and processes[name].exit_code is None
        ]
        if guests and self._is_guests_turn():
            name = " or ".join(guests)
            reason = f"hung: {what} for {limit_s:.3g} s of wall time, and the others wait"
            return Suspect(name, reason, CosimError.exit_code)
        name = min(self._members, key=self._blame)
        manner = ", and no process worked" if self._works_on is False else ""
        reason = f"hung: {what} for {limit_s:.3g} s of wall time{manner}{self._when(name)}"
        return Suspect(name, reason, CosimError.exit_code)

    def _limit(self) -> tuple[float, str]:
        """Return how long the silence may last, s, and what does not happen in it."""
        least_s = self._settings.hang_timeout
        if self.is_running():
            what = "no federate was granted anything"
            if self._works_on is False and not self._has_guests_turn():
                return least_s, what
            if self._works_on and self._may_be_long():
                return max(least_s, LONG_S), what
            return max(least_s, self._learned_s), what
        what, start_s = "it has not joined the federation", self._settings.start_timeout
        is_idle = self._works_on is False
        if is_idle and (not self._has_guests_turn() or self._guests_work is False):
            return min(least_s, start_s), what
        return start_s, what

    def _may_be_long(self) -> bool:
        words = [self._last.get(name, {}) for name in self._members]
        return any(word.get("k", -1) < 1 or word.get("state") == "finishing" for word in words)

    def _has_guests_turn(self) -> bool:
        return bool(self._guests) and self._is_guests_turn()

    def _is_guests_turn(self) -> bool:
        """Return whether the federates have all asked for a grant, or all wait for the start."""
        words = [self._last.get(name, {}) for name in self._members]
        if self.is_running():
            return all(word.get("waits") for word in words)
        return all(word.get("state") == "joining" for word in words)

    def _has_joined(self, name: str) -> bool:
        return all(self._state(member) == "joining" for member in self._whose(name))

    def _has_failed(self, name: str) -> bool:
        return any(self._state(member) == "failed" for member in self._whose(name))

    def _blame(self, name: str) -> tuple[int, bool, int]:
        """Return a key, least for the one to name: the furthest behind, then whose turn it is."""
        word = self._last.get(name, {})
        turn = (bool(word.get("waits")), -int(word.get("granted_ns", -1)))
        return _STATES.index(self._state(name)), *turn

    def _when(self, name: str) -> str:
        granted_ns = self.granted_ns()
        if name not in self._members:
            latest_ns = max(granted_ns.values(), default=-1)
            told = f" (last granted {ns_to_seconds(latest_ns):.6f} s to the others)"
            return told if latest_ns >= 0 else ""
        if granted_ns[name] < 0:
            return f" (while {self._state(name)})"
        return f" (last granted {ns_to_seconds(granted_ns[name]):.6f} s)"

    def _whose(self, name: str) -> Sequence[str]:
        """Return the federates whose state speaks for a process."""
        return (name,) if name in self._members else self._members


def _place(message: Mapping[str, Any]) -> tuple[Any, Any]:
    return message.get("state"), message.get("k")


def _have_worked(
    done: Mapping[str, Effort], known: set[str], unknown: set[str], elapsed_s: float
) -> bool | None:
    """Return whether processes have worked; None if one that is not known of may have."""
    # Of all together: on a busy machine none gets much.
    cpu_s = sum(done[name].cpu_s for name in known)
    if cpu_s >= _WORKING_SHARE * elapsed_s or any(done[name].disk_bytes > 0 for name in known):
        return True
    return None if unknown else False


def _cpu_s(message: Mapping[str, Any]) -> float:
    return float(message.get("cpu_s", 0.0))


def _manner(exit_code: int) -> str:
    if exit_code < 0:
        return f"killed by {signal.Signals(-exit_code).name}"
    return f"exit code {exit_code}"
