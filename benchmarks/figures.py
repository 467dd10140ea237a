"""What a benchmark measured: figures beside what was to be reached, as JSON and Markdown."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Literal

Goal = Literal["at least", "at most"]


@dataclass(frozen=True)
class Row:
    """One figure of a benchmark.

    Attributes:
        what: the work that was measured.
        figure: what about it, in words.
        unit: of the values; empty for a ratio.
        values: one a repetition.
        goal, reach: the figure's median is to be at least, or at most, this; None for a figure
            that stands for itself.
        peers: version of each program measured in the same run.
        note: what holds the figure back, or what a reader must know.
    """

    what: str
    figure: str
    unit: str
    values: Sequence[float]
    goal: Goal = "at least"
    reach: float | None = None
    peers: Mapping[str, str] = field(default_factory=dict)
    note: str = ""

    @property
    def median(self) -> float:
        """Return the median of the values."""
        return median(self.values)

    @property
    def falls_short(self) -> float:
        """Return by which share of the goal the median misses it; 0 where it is reached."""
        if self.reach is None:
            return 0.0
        missing = self.reach - self.median if self.goal == "at least" else self.median - self.reach
        return max(0.0, missing / self.reach)

    def text(self) -> str:
        """Return the row as one line for a terminal."""
        spread = f" ({_short(min(self.values))} to {_short(max(self.values))})"
        goal = "" if self.reach is None else f"; {self.goal} {_short(self.reach)} is to be reached"
        value = f"{_short(self.median)} {self.unit}".strip()
        return f"{self.what}: {self.figure}: {value}{spread}{goal}"

    def cells(self) -> list[str]:
        """Return the row as cells of a table: what, figure, median, spread, goal, verdict."""
        spread = f"{_short(min(self.values))} to {_short(max(self.values))} (of {len(self.values)})"
        value = f"{_short(self.median)} {self.unit}".strip()
        goal = "" if self.reach is None else f"{self.goal} {_short(self.reach)}"
        return [self.what, self.figure, value, spread, goal, self._verdict()]

    def _verdict(self) -> str:
        if self.reach is None:
            return ""
        return f"short by {100 * self.falls_short:.0f} %" if self.falls_short else "reached"


def save(rows: Sequence[Row], path: Path | None) -> None:
    """Print rows, and write them as JSON where a path is given."""
    for row in rows:
        print(row.text(), flush=True)
        if row.note:
            print(f"    {row.note}")
    if path is not None:
        path.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")


def table(rows: Sequence[Row]) -> list[str]:
    """Return rows as the lines of a Markdown table, with peers and notes below it."""
    head = ["what", "figure", "median", "spread", "goal", ""]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    lines += ["| " + " | ".join(row.cells()) + " |" for row in rows]
    peers = {f"{name} {version}" for row in rows for name, version in row.peers.items()}
    if peers:
        lines += ["", f"Measured in the same run: {', '.join(sorted(peers))}."]
    for row in rows:
        if row.note:
            lines += ["", f"{row.what}, {row.figure}: {row.note}"]
    return lines


def _short(value: float) -> str:
    """Return a number with three figures, whole where it is larger."""
    if abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}"
