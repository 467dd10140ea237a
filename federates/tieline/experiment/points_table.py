"""The tidy table of a sweep: one row a point, its swept settings and then every figure it has."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from tieline.experiment.results import POINTS, SUMMARY, Run, is_result, read_manifest

LEFT_OUT = ("label", "times", "window_s", "band_hz", "units", "against")
"""Parts of a summary that are no figure of the simulated system: wall times above all, so that
equal runs have equal tables wherever they ran."""

FIRST = ("label", "folder", "status")


def write_points(folder: Path) -> list[Path]:
    """Write `points.csv` and `points.parquet` of a sweep's folder, and return both.

    Raises:
        InputError: the folder is no result.
    """
    table = points_table(folder)
    paths = [folder / "points.csv", folder / "points.parquet"]
    parts = [path.with_name(f".{path.name}.part") for path in paths]
    table.to_csv(parts[0], index=False)
    table.to_parquet(parts[1], index=False)
    for part, path in zip(parts, paths, strict=True):
        part.replace(path)
    return paths


def points_table(folder: Path) -> pd.DataFrame:
    """Return one row for each point of a sweep, in its order, finished or not.

    Columns are `label`, `folder` (within the sweep's), `status` (complete, incomplete or missing),
    each swept setting by its name in SI units, and `GROUP.FIGURE` of the summaries in SI units or
    as the figure's name says; empty where a point has none.

    Raises:
        InputError: the folder is no result.
    """
    points = read_manifest(folder)["points"]
    rows = [_row(folder, point) for point in points]
    swept = _in_order(point["settings"] for point in points)
    figures = [name for name in _in_order(rows) if name not in (*FIRST, *swept)]
    table = pd.DataFrame(rows, columns=[*FIRST, *swept, *figures])
    for name in table.columns:
        if table[name].dtype == object:
            table[name] = _of_one_kind(table[name])
    return table


def spread(folder: Path) -> pd.DataFrame:
    """Return least, median and greatest value of each figure over a sweep's complete points.

    One row a figure that is a number, by its name, with the label of the point of either end.

    Raises:
        InputError: the folder is no result.
    """
    table = points_table(folder)
    swept = _in_order(point["settings"] for point in read_manifest(folder)["points"])
    rows = {}
    for name in table.columns:
        values = table[name].dropna()
        is_number = pd.api.types.is_numeric_dtype(values) and values.dtype != "bool"
        if name in (*FIRST, *swept) or values.empty or not is_number:
            continue
        labels = table["label"].to_numpy()[values.index]
        least, greatest = values.to_numpy().argmin(), values.to_numpy().argmax()
        rows[name] = {
            "least": values.min(),
            "at": labels[least],
            "median": values.median(),
            "greatest": values.max(),
            "at ": labels[greatest],
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def _row(folder: Path, point: Mapping[str, Any]) -> dict[str, Any]:
    inside = f"{POINTS}/{point['slug']}"
    row: dict[str, Any] = {"label": point["label"], "folder": inside, "status": "missing"}
    row |= point["settings"]
    if not is_result(folder / inside):
        return row
    run = Run(folder / inside, read_manifest(folder / inside))
    row["status"] = run.manifest["status"]
    if run.is_complete and (run.folder / SUMMARY).is_file():
        row |= _figures(run.summary())
    return row


def _figures(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the single values of a summary, by group and name."""
    found: dict[str, Any] = {}
    for group, content in summary.items():
        if group in LEFT_OUT:
            continue
        if not isinstance(content, Mapping):
            found[group] = content
            continue
        for name, value in content.items():
            if name not in LEFT_OUT and not isinstance(value, Mapping | list):
                found[f"{group}.{name}"] = value
    return found


def _in_order(rows: Any) -> list[str]:
    """Return every key of some mappings, each at its first place."""
    return list(dict.fromkeys(name for row in rows for name in row))


def _of_one_kind(values: "pd.Series[Any]") -> Sequence[Any]:
    """Return a column that a file can hold: numbers, truths, or text where kinds are mixed."""
    known = [value for value in values if value is not None and value == value]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in known):
        return list(pd.to_numeric(values).astype("float64"))
    if all(isinstance(value, str) for value in known):
        return list(values)
    return [_text(value) for value in values]


def _text(value: Any) -> str | None:
    if value is None or isinstance(value, str):
        return value
    return json.dumps(value)
