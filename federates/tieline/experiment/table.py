"""The closing table: one row a run, for the terminal and as CSV."""

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Summary = Mapping[str, Any]


@dataclass(frozen=True)
class Field:
    """One column: heading and format in the terminal, name in the CSV, and where its value is."""

    heading: str
    name: str
    path: tuple[str, str]
    shown: Callable[[float], str]


FIELDS = (
    Field("delay\nms", "delay_mean_s", ("delay", "mean_s"), lambda v: f"{1e3 * v:.1f}"),
    Field("p95\nms", "delay_p95_s", ("delay", "p95_s"), lambda v: f"{1e3 * v:.1f}"),
    Field("jitter\nms", "jitter_s", ("delay", "jitter_s"), lambda v: f"{1e3 * v:.2f}"),
    Field("loss\n%", "loss", ("packets", "loss"), lambda v: f"{100 * v:.2f}"),
    Field("nadir\nHz", "nadir_hz", ("frequency", "nadir_hz"), lambda v: f"{v:.3f}"),
    Field("at\ns", "nadir_s", ("frequency", "nadir_s"), lambda v: f"{v:.1f}"),
    Field("settles\nHz", "settling_hz", ("frequency", "settling_hz"), lambda v: f"{v:.3f}"),
    Field("swing\nHz", "swing_hz", ("swing", "frequency_hz"), lambda v: f"{v:.3f}"),
    Field("damp.\nratio", "damping_ratio", ("swing", "damping_ratio"), lambda v: f"{v:.3f}"),
    Field("wall\ns", "wall_s", ("times", "wall_s"), lambda v: f"{v:.1f}"),
)


def value(summary: Summary, field: Field) -> float | None:
    """Return one cell of a summary, in SI units; None where there is none."""
    part, key = field.path
    found: float | None = summary.get(part, {}).get(key)
    return found


def shown(summary: Summary, field: Field) -> str:
    """Return one cell as the terminal shows it."""
    found = value(summary, field)
    return "-" if found is None else field.shown(found)


def write_csv(path: Path, summaries: Sequence[Summary]) -> None:
    """Write the table as CSV, in SI units, without a value where there is none."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["label", *(field.name for field in FIELDS)])
        for summary in summaries:
            writer.writerow([summary["label"], *(value(summary, field) for field in FIELDS)])
