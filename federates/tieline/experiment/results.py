"""Reads result folders: a run, or a sweep of runs; knows nothing of how they were made."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from tieline.experiment.folder import FORMAT, MANIFEST, is_result, read_json, read_manifest
from tieline.experiment.table_hash import table_hash
from tieline.table_parts import row_count
from tieline.tables import column_names, read_table, read_values, stored

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
_VALUES_AT_ONCE = 300_000


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
        return stored(self.folder / f"{name}.parquet")

    def table(self, name: str, *columns: str) -> "pd.DataFrame":
        """Return a table (`grid`, `flows`, ...), or some columns; no rows if it was not written."""
        path = self.path(name)
        if path is not None:
            return read_table(path, columns or None)
        import pandas as pd

        return pd.DataFrame()

    def values(self, name: str, *columns: str) -> dict[str, NDArray[Any]]:
        """Return a table's columns, or some, as arrays, NaN for null; none if it was not written.

        Nothing is imported for it, so that what ends a run waits for nothing.
        """
        path = self.path(name)
        return {} if path is None else read_values(path, columns or None)

    def each(self, name: str, columns: Sequence[str]) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield name and values of some columns of a table, as many read at a time as `blocks`."""
        for some in self._at_once(name, columns):
            yield from self.values(name, *some).items()

    def blocks(self, name: str, columns: Sequence[str]) -> "Iterator[pd.DataFrame]":
        """Yield some columns of a table that was written, as many at a time as are a few MB."""
        for some in self._at_once(name, columns):
            yield self.table(name, *some)

    def columns(self, name: str) -> list[str]:
        """Return the names of a table's columns; none if it was not written."""
        path = self.path(name)
        return [] if path is None else column_names(path)

    def events(self) -> list[tuple[float, str]]:
        """Return (instant in s, what happens) of each event, in order of time."""
        log = self.values("events")
        if not log:
            return []
        return [(float(t_s), str(what)) for t_s, what in zip(log["t_s"], log["what"], strict=True)]

    def ending(self) -> str | None:
        """Return why the run was over before its time, as a result; None if it was not."""
        log = self.values("events")
        if not log or not log["is_ending"].any():
            return None
        row = log["is_ending"].tolist().index(1)
        return f"{log['what'][row]} at {log['t_s'][row]:.3f} s"

    def tripped_units(self) -> set[str]:
        """Return the units that an event trips; they go on alone and count in no average."""
        events = self.config["grid"]["events"]
        return {event["trip_generator"] for event in events if "trip_generator" in event}

    def _at_once(self, name: str, columns: Sequence[str]) -> Iterator[Sequence[str]]:
        path = self.path(name)
        count = 1 if path is None else max(1, _VALUES_AT_ONCE // max(1, row_count(path)))
        for first in range(0, len(columns), count):
            yield columns[first : first + count]


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
