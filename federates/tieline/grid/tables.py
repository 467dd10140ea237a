"""Reads a case's CSV tables strictly: every cell is checked, every finding keeps file and line."""

import csv
import difflib
import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tieline.errors import InputError
from tieline.resources import is_endless

LARGEST_WHOLE = 999_999_999

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)", re.IGNORECASE)
_WHOLE = re.compile(r"[1-9]\d{0,8}", re.ASCII)


@dataclass(frozen=True)
class Row:
    """One line of a table: `cells` by column name, stripped of blanks, and where it stands."""

    where: str
    cells: Mapping[str, str]


@dataclass(frozen=True)
class Table:
    """A table as far as it could be read.

    Attributes:
        is_whole: whether every row was read; else what seems to lack a row may stand in a lost one.
    """

    name: str
    rows: tuple[Row, ...]
    is_whole: bool


class Findings:
    """Collects what is wrong with a case, to be reported in one message."""

    def __init__(self) -> None:
        self.items: list[str] = []

    def add(self, where: str, text: str) -> None:
        """Note one finding."""
        self.items.append(f"{where}: {text}")

    def number(self, row: Row, column: str) -> float:
        """Return a finite number of a row; a finding and NaN if the cell holds none.

        NaN passes every later comparison, so that one mistake is reported once.
        """
        text = row.cells[column]
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if math.isfinite(value):
            return value
        is_number = _NUMBER.fullmatch(text) or _NOT_FINITE.fullmatch(text)
        allowed = "finite" if is_number else "a number"
        self.add(row.where, f"'{column}' must be {allowed} (got {text!r})")
        return math.nan

    def whole(self, row: Row, column: str) -> int | None:
        """Return a whole number from 1 of a row; a finding and None if the cell holds none."""
        text = row.cells[column]
        if _WHOLE.fullmatch(text):
            return int(text)
        self.add(
            row.where,
            f"'{column}' must be a whole number from 1 to {LARGEST_WHOLE} (got {text!r})",
        )
        return None

    def word(self, row: Row, column: str, allowed: Sequence[str]) -> str | None:
        """Return a word of a row that must be one of `allowed`; a finding and None if it is not."""
        text = row.cells[column]
        if text in allowed:
            return text
        self.add(
            row.where,
            f"'{column}' must be one of {', '.join(allowed)} (got {text!r}{near(text, allowed)})",
        )
        return None

    def known(self, where: str, what: str, given: object, allowed: Sequence[object]) -> bool:
        """Return whether `given` is among `allowed`; a finding with the nearest one if not."""
        if given in allowed:
            return True
        self.add(where, f"no {what} '{given}'{near(str(given), [str(item) for item in allowed])}")
        return False

    def unique(self, rows: Sequence[Row], keys: Sequence[object], what: str) -> None:
        """Note every row whose key, if it is not None, stands in an earlier row."""
        seen: dict[object, str] = {}
        for row, key in zip(rows, keys, strict=True):
            if key in seen:
                self.add(row.where, f"{what} {key} stands already in {seen[key]}")
            elif key is not None:
                seen[key] = row.where

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


def read_table(
    path: Path,
    required: Sequence[str],
    optional: Sequence[str],
    findings: Findings,
    *,
    must_exist: bool = True,
) -> Table:
    """Return a table whose header names the columns, in any order.

    UTF-8 with or without a byte-order mark, any line ends; lines without text are passed over.

    Args:
        path: the CSV file; the first line is its header.
        required: columns that must be there.
        optional: columns that may be there.
        findings: takes what cannot be read, missing, unknown and repeated columns, ragged lines.
        must_exist: False for a table that a case may leave out.
    """
    name = path.name
    if not path.exists():
        if must_exist:
            findings.add(name, f"missing in {path.parent.name}/")
        return Table(name, (), is_whole=not must_exist)
    before = len(findings.items)
    lines = list(_lines(path, findings))
    if not lines:
        if len(findings.items) == before:
            findings.add(f"{name}:1", f"is empty; its header needs {', '.join(required)}")
        return Table(name, (), is_whole=False)
    _check_header(lines[0][0], lines[0][1], required, optional, findings)
    if len(findings.items) > before:
        return Table(name, (), is_whole=False)
    header, rows = lines[0][1], []
    for where, cells in lines[1:]:
        if len(cells) == len(header):
            rows.append(Row(where, dict(zip(header, cells, strict=True))))
        else:
            findings.add(where, f"has {len(cells)} cells, the header {len(header)}")
    return Table(name, tuple(rows), is_whole=len(findings.items) == before)


def _lines(path: Path, findings: Findings) -> Iterator[tuple[str, list[str]]]:
    """Yield place and stripped cells of each line that says anything, up to one beyond reading."""
    if is_endless(path):
        findings.add(path.name, "cannot be read (it is a device or a pipe)")
        return
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        findings.add(path.name, f"cannot be read ({error.strerror})")
        return
    except UnicodeDecodeError as error:
        findings.add(path.name, f"is not UTF-8 text (byte {error.start})")
        return
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    first = 1
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if any(cells):
                yield f"{path.name}:{first}", cells
            first = reader.line_num + 1
    except csv.Error as error:
        findings.add(f"{path.name}:{first}", f"is malformed ({error})")


def _check_header(
    where: str,
    header: Sequence[str],
    required: Sequence[str],
    optional: Sequence[str],
    findings: Findings,
) -> None:
    allowed = [*required, *optional]
    for position, column in enumerate(header):
        if column in header[:position]:
            findings.add(where, f"column '{column}' stands twice")
        else:
            findings.known(where, "column", column, allowed)
    for column in required:
        if column not in header:
            findings.add(where, f"column '{column}' is missing")
