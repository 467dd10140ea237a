"""Reads a case's CSV tables strictly: every cell is checked, every finding keeps file and line."""

import csv
import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tieline.errors import InputError


@dataclass(frozen=True)
class Row:
    """One line of a table: `cells` by column name, and where it stands."""

    where: str
    cells: Mapping[str, str]


class Findings:
    """Collects what is wrong with a case, to be reported in one message."""

    def __init__(self) -> None:
        self.items: list[str] = []

    def add(self, where: str, text: str) -> None:
        """Note one finding."""
        self.items.append(f"{where}: {text}")

    def number(self, row: Row, column: str) -> float:
        """Return a finite number of a row; a finding and 0 if the cell holds none."""
        text = row.cells.get(column, "")
        try:
            value = float(text)
        except ValueError:
            self.add(row.where, f"'{column}' must be a number (got {text!r})")
            return 0.0
        if abs(value) == float("inf") or value != value:
            self.add(row.where, f"'{column}' must be finite (got {text!r})")
            return 0.0
        return value

    def whole(self, row: Row, column: str) -> int:
        """Return a whole number of a row; a finding and 0 if the cell holds none."""
        text = row.cells.get(column, "")
        if not text.strip().lstrip("-").isdigit():
            self.add(row.where, f"'{column}' must be a whole number (got {text!r})")
            return 0
        return int(text)

    def word(self, row: Row, column: str, allowed: Sequence[str]) -> str:
        """Return a word of a row that must be one of `allowed`; else a finding and the first."""
        text = row.cells.get(column, "").strip()
        if text in allowed:
            return text
        self.add(
            row.where,
            f"'{column}' must be one of {', '.join(allowed)} (got {text!r}{near(text, allowed)})",
        )
        return allowed[0]

    def known(self, where: str, what: str, given: object, allowed: Sequence[object]) -> bool:
        """Return whether `given` is among `allowed`; a finding with the nearest one if not."""
        if given in allowed:
            return True
        self.add(where, f"no {what} '{given}'{near(str(given), [str(item) for item in allowed])}")
        return False

    def stop(self) -> None:
        """Raise what was found, if anything.

        Raises:
            InputError: there are findings.
        """
        if self.items:
            raise InputError(self.items)


def near(word: str, allowed: Sequence[str]) -> str:
    """Return `; did you mean 'x'?` for the allowed word nearest to `word`, or nothing."""
    match = difflib.get_close_matches(word, allowed, n=1)
    return f"; did you mean '{match[0]}'?" if match else ""


def read_rows(
    path: Path,
    required: Sequence[str],
    optional: Sequence[str],
    findings: Findings,
    *,
    must_exist: bool = True,
) -> list[Row]:
    """Return the rows of a table whose header names the columns, in any order.

    Args:
        path: the CSV file; the first line is its header.
        required: columns that must be there.
        optional: columns that may be there.
        findings: takes missing files and columns, unknown columns and ragged lines.
        must_exist: False for a table that a case may leave out.
    """
    name = path.name
    if not path.is_file():
        if must_exist:
            findings.add(name, f"missing in {path.parent.name}/")
        return []
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    header = [cell.strip() for cell in lines[0]] if lines else []
    allowed = [*required, *optional]
    for column in header:
        findings.known(f"{name}:1", "column", column, allowed)
    for column in required:
        if column not in header:
            findings.add(f"{name}:1", f"column '{column}' is missing")
    rows = []
    for number, cells in enumerate(lines[1:], start=2):
        if len(cells) != len(header):
            findings.add(f"{name}:{number}", f"has {len(cells)} cells, the header {len(header)}")
        else:
            rows.append(Row(f"{name}:{number}", dict(zip(header, cells, strict=True))))
    return rows


def unique(
    rows: Sequence[Row], key: Callable[[Row], object], what: str, findings: Findings
) -> None:
    """Note every row whose key stands in an earlier row."""
    seen: dict[object, str] = {}
    for row in rows:
        value = key(row)
        if value in seen:
            findings.add(row.where, f"{what} {value} stands already in {seen[value]}")
        else:
            seen[value] = row.where
