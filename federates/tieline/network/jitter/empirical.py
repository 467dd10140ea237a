"""Delays drawn from a measured sample."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field

from tieline.network.entry import Entry, named_file
from tieline.network.jitter.base import Jitter
from tieline.units import seconds_to_ns

COLUMN = "delay_s"


@dataclass(frozen=True)
class EmpiricalJitter:
    """Each value of a sample is equally likely; neighbours in the sample mean nothing.

    Attributes:
        sample_ns: the delays, one or more.
    """

    sample_ns: tuple[int, ...]

    @property
    def mean_ns(self) -> float:
        """The mean of the sample."""
        return sum(self.sample_ns) / len(self.sample_ns)

    @property
    def least_ns(self) -> int:
        """The least of the sample."""
        return min(self.sample_ns)

    def draw(self, generator: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Return `count` delays in nanoseconds."""
        return generator.choice(np.array(self.sample_ns, dtype=np.int64), count)


def read_sample(path: Path) -> list[int]:
    """Return the delays of a CSV file, ns.

    Raises:
        ValueError: there is no such file, it has no column `delay_s`, no row, or a value that is no
            time between 0 and 10 s.
    """
    try:
        with path.open(newline="", encoding="utf-8") as lines:
            rows = csv.DictReader(lines)
            if COLUMN not in (rows.fieldnames or ()):
                raise ValueError(f"{path}:1: no column '{COLUMN}' (has {rows.fieldnames})")
            sample = [_delay_ns(path, rows.line_num, row[COLUMN]) for row in rows]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"cannot read {path}: {error}") from error
    if not sample:
        raise ValueError(f"{path} holds no delay")
    return sample


def _delay_ns(path: Path, line: int, given: str) -> int:
    try:
        delay_s = float(given)
    except (TypeError, ValueError):
        delay_s = math.nan
    if not 0 <= delay_s <= 10:
        raise ValueError(f"{path}:{line}: '{COLUMN}' must be >= 0 and <= 10 s (got {given!r})")
    return seconds_to_ns(delay_s)


def _checked(path: Path) -> Path:
    read_sample(path)
    return path


class EmpiricalEntry(Entry):
    """A sample in a CSV file with a column `delay_s`."""

    distribution: Literal["empirical"] = Field(description="which distribution this is")
    file: Annotated[Path, BeforeValidator(named_file), AfterValidator(_checked)] = Field(
        description="CSV file, relative to the file that names it"
    )

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return EmpiricalJitter(tuple(read_sample(self.file)))
