"""The logs of one launch: one of each process, the launcher's own, and all of them merged."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tieline.experiment.supervise import Child, ProcessUse
from tieline.experiment.watch import Suspect, Watch
from tieline.logs import LOGS, Log, merge


class RunLogs:
    """Where the launcher's side of a run's logs is written.

    Args:
        folder: the run folder; the logs go to its `logs/`.
        watch: knows how far the run has come.
        name: of the launcher's own log.
    """

    def __init__(self, folder: Path, watch: Watch, name: str) -> None:
        self._folder = folder
        self._watch = watch
        self._own = self.of(name)
        self._words: dict[str, Mapping[str, Any]] = {}
        self._used: set[str] = set()
        self._has_fault = False

    def of(self, name: str) -> Log:
        """Return a new log for a process."""
        return Log(self._folder / LOGS / f"{name}.jsonl", name, self._reached_ns)

    def started(self, child: Child, command: Sequence[str]) -> None:
        """Note that a process was started."""
        text = f"{child.name} is started"
        self._own.note("info", "start", text, pid=child.pid, command=[*command])

    def hear(self, word: Mapping[str, Any]) -> None:
        """Keep the last word of each federate, for when one is at fault."""
        self._words[str(word.get("federate"))] = word

    def fault(self, suspect: Suspect) -> None:
        """Note who is at fault, and what all the federates were doing."""
        self._has_fault = True
        text = f"{suspect.name}: {suspect.reason}"
        facts = {**asdict(suspect), "words": self._words}
        self._own.note("error", "fault", text, **facts)

    def used(self, use: ProcessUse | None) -> None:
        """Note once how a process ended and what it cost."""
        if use is None or use.name in self._used:
            return
        self._used.add(use.name)
        level = "info" if use.exit_code == 0 else "warning"
        text = f"{use.name} ended with code {use.exit_code}"
        self._own.note(level, "exit", text, **asdict(use))

    def ended(self) -> None:
        """Note that all went well."""
        self._own.note("info", "end", "every federate reached the end")

    def failed(self, error: BaseException) -> None:
        """Note what ended the run, if that is not a fault that was noted."""
        if self._has_fault:
            return
        text = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        first = text.splitlines()[0] if text else ""
        self._own.note("error", "failed", first, error=type(error).__name__, words=self._words)

    def close(self) -> None:
        """Merge the logs; those of the other processes are closed by now."""
        try:
            merge(self._folder)
        except OSError as error:
            self._own.note("warning", "merge", f"the logs could not be merged: {error}")
        self._own.close()

    def _reached_ns(self) -> int | None:
        reached_ns = max(self._watch.granted_ns().values())
        return reached_ns if reached_ns >= 0 else None
