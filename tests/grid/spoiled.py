"""Copies of the shipped case, and ways to spoil them."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tieline.errors import InputError
from tieline.grid.case import load_case
from tieline.resources import case_folder

TABLES = ("bus", "branch", "load", "machine", "exciter", "governor", "pss")
CASE_YAML = """\
name: miniwecc
title: A copy to spoil
base_MVA: 100
frequency_Hz: 60
areas: [Alberta, BC, North, nWest, sWest, East]
sensors: [2, 4, 6]
tie_mode:
  units: [G34]
  against: [G21]
  band_Hz: [0.2, 0.8]
"""


def cell(table: str, line: int, column: str, text: str) -> Callable[[Path], None]:
    """Return a change of one cell; line 1 is the header."""

    def change(folder: Path) -> None:
        path = folder / f"{table}.csv"
        rows = [row.split(",") for row in path.read_text().splitlines()]
        rows[line - 1][rows[0].index(column)] = text
        path.write_text("\n".join(",".join(row) for row in rows) + "\n")

    return change


def replaced(name: str, old: str, new: str) -> Callable[[Path], None]:
    """Return a change of the first occurrence of a text."""

    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return change


def without_column(table: str, column: str) -> Callable[[Path], None]:
    """Return the removal of a column."""

    def change(folder: Path) -> None:
        path = folder / f"{table}.csv"
        rows = [row.split(",") for row in path.read_text().splitlines()]
        at = rows[0].index(column)
        path.write_text("\n".join(",".join(r[:at] + r[at + 1 :]) for r in rows) + "\n")

    return change


def added(name: str, line: str) -> Callable[[Path], None]:
    """Return the addition of a last line."""
    return lambda folder: (folder / name).write_text((folder / name).read_text() + line + "\n")


def written(name: str, content: bytes) -> Callable[[Path], None]:
    """Return a change of a whole file."""
    return lambda folder: (folder / name).write_bytes(content) and None


def copied(parent: Path) -> Path:
    """Return a copy of the shipped case inside `parent`."""
    folder = parent / "miniwecc"
    folder.mkdir()
    for table in TABLES:
        shutil.copy(case_folder("miniwecc") / f"{table}.csv", folder / f"{table}.csv")
    (folder / "case.yaml").write_text(CASE_YAML)
    return folder


def findings_of(folder: Path) -> tuple[str, ...]:
    """Return what is found wrong with a case."""
    with pytest.raises(InputError) as caught:
        load_case(folder)
    return caught.value.findings
