"""Strict priority by DSCP: a packet waits for all that is more urgent, never for what is less.

A packet in transmission is not interrupted. A queue of only urgent packets starves the rest.
"""

from dataclasses import dataclass
from typing import Literal

from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.queues.base import EarlyDetection, Queue, WaitingLine
from tieline.network.queues.classes import ClassEntry, check_marks, line_of


@dataclass(frozen=True)
class StrictPriority:
    """Lines in the order of urgency.

    Attributes:
        lines: the waiting lines.
        marks: the DSCPs of each; the last takes what no other does.
    """

    lines: tuple[WaitingLine, ...]
    marks: tuple[frozenset[int], ...]

    @property
    def order(self) -> Literal["priority"]:
        """The first line that is not empty."""
        return "priority"

    @property
    def early_detection(self) -> EarlyDetection | None:
        """None."""
        return None

    def line_of(self, dscp: int) -> int:
        """Return the first line that takes a DSCP."""
        return line_of(dscp, self.marks)


class PriorityEntry(Entry):
    """Classes, the most urgent first."""

    discipline: Literal["priority"] = Field(description="which queue this is")
    classes: list[ClassEntry] = Field(
        min_length=1, max_length=8, description="waiting lines, the most urgent first"
    )

    @model_validator(mode="after")
    def _distinct(self) -> "PriorityEntry":
        check_marks(self.classes)
        return self

    def queue(self) -> Queue:
        """Return the discipline."""
        lines = tuple(entry.line() for entry in self.classes)
        return StrictPriority(lines, tuple(frozenset(entry.dscp) for entry in self.classes))
