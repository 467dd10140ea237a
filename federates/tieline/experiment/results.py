"""Reads result folders: a run, or a sweep of runs; knows nothing of how they were made."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tieline.columns import Columns, Tables
from tieline.experiment.folder import FORMAT, MANIFEST, is_result, read_json, read_manifest
from tieline.experiment.table_hash import table_hash
from tieline.tables import read_table

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "FORMAT",
    "MANIFEST",
    "MAP",
    "POINTS",
    "SUMMARY",
    "Run",
    "common_events",
    "is_result",
    "read_json",
    "read_manifest",
    "read_runs",
    "table_hash",
]

SUMMARY = "summary.json"
POINTS = "points"
MAP = "map.json"


@dataclass(frozen=True)
class Run:
    """The folder of one run; tables are read when they are asked for."""

    folder: Path
    manifest: Mapping[str, Any]

    @property
    def label(self) -> str:
        """What the sweep calls this run; without a sweep, the experiment's name."""
        return str(self.manifest["label"] or self.manifest["name"])

    @property
    def config(self) -> Mapping[str, Any]:
        """Every setting that was in force."""
        config: Mapping[str, Any] = self.manifest["config"]
        return config

    @property
    def is_complete(self) -> bool:
        """Whether every federate reached the end."""
        return bool(self.manifest["status"] == "complete")

    def told(self) -> Mapping[str, Any]:
        """Return the run file that the federates were given."""
        return read_json(self.folder / "run.json")

    def map(self) -> Mapping[str, Any] | None:
        """Return stations, lines and links with their places; None if the run wrote none."""
        path = self.folder / MAP
        return read_json(path) if path.is_file() else None

    def summary(self) -> Mapping[str, Any]:
        """Return the summary."""
        return read_json(self.folder / SUMMARY)

    def path(self, name: str) -> Path | None:
        """Return the file of a table; None if it was not written."""
        return self._tables.path(name)

    def table(self, name: str, *columns: str) -> "pd.DataFrame":
        """Return a table (`grid`, `flows`, ...), or some columns; no rows if it was not written."""
        path = self.path(name)
        if path is not None:
            return read_table(path, columns or None)
        import pandas as pd

        return pd.DataFrame()

    def values(self, name: str, *columns: str) -> Columns:
        """Return a table, or some columns, as arrays (rows,); nothing if it was not written."""
        with self._tables.opened(name) as table:
            return {} if table is None else table.read(columns or None)

    def blocks(self, name: str, columns: Sequence[str]) -> Iterator[Columns]:
        """Yield some columns of a table that was written, as many at a time as are a few MB."""
        with self._tables.opened(name) as table:
            if table is not None:
                yield from table.blocks(columns)

    def columns(self, name: str) -> list[str]:
        """Return the names of a table's columns; none if it was not written."""
        return self._tables.names(name)

    def events(self) -> list[tuple[float, str]]:
        """Return (instant in s, what happens) of each event, in order of time."""
        return [(at_s, what) for at_s, what, _ in self._log]

    def ending(self) -> str | None:
        """Return why the run was over before its time, as a result; None if it was not."""
        return next((f"{what} at {at_s:.3f} s" for at_s, what, ends in self._log if ends), None)

    def tripped_units(self) -> set[str]:
        """Return the units that an event trips; they go on alone and count in no average."""
        events = self.config["grid"]["events"]
        return {event["trip_generator"] for event in events if "trip_generator" in event}

    @cached_property
    def delays(self) -> Columns:
        """The histogram of the delays between first and last arrivals; nothing without arrivals."""
        counts = self.values("delays")
        if not counts or not counts["count"].any():
            return {}
        filled = np.flatnonzero(counts["count"])
        return {name: values[filled[0] : filled[-1] + 1] for name, values in counts.items()}

    def kept_open(self) -> AbstractContextManager[None]:
        """Open each table once for all that is read of it within a `with`."""
        return self._tables.kept_open()

    @cached_property
    def _tables(self) -> Tables:
        return Tables(self.folder)

    @cached_property
    def _log(self) -> list[tuple[float, str, bool]]:
        """Instant in s, what happens, and whether the run ends with it."""
        log = self.values("events")
        if not log:
            return []
        rows = zip(log["t_s"], log["what"], log["is_ending"], strict=True)
        return [(float(at_s), str(what), bool(ends)) for at_s, what, ends in rows]


def common_events(runs: Sequence[Run]) -> list[tuple[float, str]]:
    """Return the events that all runs have, as (instant in s, what happens), in order of time."""
    logs = [run.events() for run in runs]
    return [event for event in logs[0] if all(event in log for log in logs)] if logs else []


def read_runs(folder: Path) -> list[Run]:
    """Return the runs of a result, complete or not, in the order of its sweep.

    Raises:
        InputError: the folder is no result.
    """
    manifest = read_manifest(folder)
    if manifest["kind"] == "run":
        return [Run(folder, manifest)]
    folders = [folder / POINTS / point["slug"] for point in manifest["points"]]
    return [Run(path, read_manifest(path)) for path in folders if is_result(path)]
