"""What the paper states, and the rule by which a number of ours judges a statement.

    reproduced                    the number lies in the statement's band, and nothing is held
                                  against it
    reproduced with a difference  it lies in the wider band whose difference is explained, or in the
                                  band and something is held against it
    not reproduced                anything else, no number among it

No verdict is written by hand: a statement has a band with its reason, a run of the equations gives
the number.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """What became of a statement."""

    REPRODUCED = "reproduced"
    DIFFERENT = "reproduced with a difference"
    NOT = "not reproduced"


@dataclass(frozen=True)
class Source:
    """Where a statement was read.

    Attributes:
        name: what a table calls it.
        what: a sentence on it.
    """

    name: str
    what: str


@dataclass(frozen=True)
class Band:
    """Where a number may lie, both ends included."""

    low: float = -math.inf
    high: float = math.inf

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high

    def __str__(self) -> str:
        if self.low == -math.inf:
            return f"at most {self.high:g}"
        if self.high == math.inf:
            return f"at least {self.low:g}"
        return f"{self.low:g} to {self.high:g}"


def about(value: float, by: float) -> Band:
    """Return the band of a value that may be off by `by` to either side."""
    return Band(value - by, value + by)


@dataclass(frozen=True)
class Statement:
    """One statement that one number judges.

    Attributes:
        id: short name, unique among all items.
        text: what is stated, in our words.
        source: where it was read.
        number: name of the number that the item computes.
        paper: the stated number or word, as a table shows it.
        band: where the number makes the statement true.
        tolerance: why the band is as wide as it is.
        differs: a wider band, whose difference from `band` is understood.
        difference: what makes the difference, or what speaks about it where it is not understood;
            `{name}` stands for another number of the item.
        against: what is held against the number even where it lies in the band.
        unit: of the number, empty for a ratio.
        digits: how the number is shown, as a format.
    """

    id: str
    text: str
    source: Source
    number: str
    paper: str
    band: Band
    tolerance: str
    differs: Band | None = None
    difference: str = ""
    against: str = ""
    unit: str = ""
    digits: str = ".3f"


@dataclass(frozen=True)
class Row:
    """A judged statement.

    Attributes:
        item: id of the item that it belongs to.
        statement: what was judged.
        value: our number, NaN where there is none.
        verdict: by the rule of this module.
        why: the reason of the band, or of the difference, with numbers.
    """

    item: str
    statement: Statement
    value: float
    verdict: Verdict
    why: str

    @property
    def ours(self) -> str:
        """Return our number as a table shows it."""
        if math.isnan(self.value):
            return "none"
        return f"{self.value:{self.statement.digits}} {self.statement.unit}".strip()


def verdict_of(statement: Statement, value: float) -> Verdict:
    """Return what a number says of a statement."""
    if value in statement.band:
        return Verdict.DIFFERENT if statement.against else Verdict.REPRODUCED
    if statement.differs is not None and value in statement.differs:
        return Verdict.DIFFERENT
    return Verdict.NOT


def judged(item: str, statement: Statement, numbers: Mapping[str, float]) -> Row:
    """Return a statement with our number and the verdict.

    Args:
        item: id of its item.
        statement: what is judged.
        numbers: the item's numbers by name; a missing one counts as none.
    """
    value = float(numbers.get(statement.number, math.nan))
    verdict = verdict_of(statement, value)
    if verdict is Verdict.REPRODUCED:
        return Row(item, statement, value, verdict, statement.tolerance)
    reason = statement.against if value in statement.band else statement.difference
    outside = "" if value in statement.band else f"not {statement.band}: "
    return Row(item, statement, value, verdict, outside + reason.format_map(_Shown(numbers)))


class _Shown(dict[str, float]):
    # A number that an item could not find must not hide the rest of a reason.
    def __missing__(self, name: str) -> float:
        return math.nan
