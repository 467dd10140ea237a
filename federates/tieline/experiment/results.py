"""Reads result folders: a run, or a sweep of runs; knows nothing of how they were made."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.parquet as pq

from tieline.errors import InputError
from tieline.tables import column_names, read_table

if TYPE_CHECKING:
    import pandas as pd

MANIFEST = "manifest.json"
SUMMARY = "summary.json"
POINTS = "points"
MAP = "map.json"
FORMAT = "tieline-result/1"


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

    def table(self, name: str, *columns: str) -> "pd.DataFrame":
        """Return a table (`grid`, `flows`, ...), or some columns; no rows if it was not written."""
        path = self.folder / f"{name}.parquet"
        if path.is_file():
            return read_table(path, columns or None)
        import pandas as pd

        return pd.DataFrame()

    def columns(self, name: str) -> list[str]:
        """Return the names of a table's columns; none if it was not written."""
        path = self.folder / f"{name}.parquet"
        return column_names(path) if path.is_file() else []

    def events(self) -> list[tuple[float, str]]:
        """Return (instant in s, what happens) of each event, in order of time."""
        log = self.table("events")
        if log.empty:
            return []
        return [(float(t_s), str(what)) for t_s, what in zip(log["t_s"], log["what"], strict=True)]

    def ending(self) -> str | None:
        """Return why the run was over before its time, as a result; None if it was not."""
        log = self.table("events")
        if log.empty or not log["is_ending"].any():
            return None
        row = log[log["is_ending"] == 1].iloc[0]
        return f"{row['what']} at {row['t_s']:.3f} s"

    def tripped_units(self) -> set[str]:
        """Return the units that an event trips; they go on alone and count in no average."""
        events = self.config["grid"]["events"]
        return {event["trip_generator"] for event in events if "trip_generator" in event}


def common_events(runs: Sequence[Run]) -> list[tuple[float, str]]:
    """Return the events that all runs have, as (instant in s, what happens), in order of time."""
    logs = [run.events() for run in runs]
    return [event for event in logs[0] if all(event in log for log in logs)] if logs else []


def read_json(path: Path) -> Any:
    """Return what a JSON file of a result holds.

    Raises:
        InputError: it is missing or malformed.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise InputError(f"{path}: is no JSON ({error})") from error


def is_result(folder: Path) -> bool:
    """Return whether a folder is a result of tieline, whole or not."""
    try:
        manifest = read_json(folder / MANIFEST)
    except InputError:
        return False
    return isinstance(manifest, dict) and manifest.get("format") == FORMAT


def read_manifest(folder: Path) -> Mapping[str, Any]:
    """Return the manifest of a run or a sweep.

    Raises:
        InputError: the folder is no result.
    """
    if not is_result(folder):
        raise InputError(f"{folder} is no result folder: it has no {MANIFEST} of {FORMAT}")
    manifest: Mapping[str, Any] = read_json(folder / MANIFEST)
    return manifest


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


def table_hash(path: Path) -> str:
    """Return the SHA-256 of what a table says: names, types and values of its columns, in order.

    Row groups, compression and metadata do not enter, so tables with equal content have equal
    hashes. A null in a column of numbers counts as NaN.
    """
    digest = hashlib.sha256()
    table = pq.read_table(path)
    for name in table.column_names:
        column = table.column(name)
        digest.update(f"{name}\n{column.type}\n{len(column)}\n".encode())
        values = column.to_numpy()
        if values.dtype == object:
            texts = [None if value is None else str(value) for value in values]
            digest.update(json.dumps(texts).encode())
            continue
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), np.nan, values).astype(values.dtype)
        digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()
