"""Deficit round robin: classes share the link in the ratio of their quanta, in bytes.

M. Shreedhar and G. Varghese, Efficient fair queuing using deficit round-robin, IEEE/ACM Trans.
Networking 4 (1996).
"""

from dataclasses import dataclass
from typing import Literal

from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.queues.base import EarlyDetection, Queue, WaitingLine
from tieline.network.queues.classes import ClassEntry, check_marks, line_of
from tieline.units import Bytes


@dataclass(frozen=True)
class DeficitRoundRobin:
    """Lines that are visited in turn.

    Attributes:
        lines: the waiting lines with their quanta.
        marks: the DSCPs of each; the last takes what no other does.
    """

    lines: tuple[WaitingLine, ...]
    marks: tuple[frozenset[int], ...]

    @property
    def order(self) -> Literal["round_robin"]:
        """In turn."""
        return "round_robin"

    @property
    def early_detection(self) -> EarlyDetection | None:
        """None."""
        return None

    def line_of(self, dscp: int) -> int:
        """Return the line that takes a DSCP."""
        return line_of(dscp, self.marks)


class ShareEntry(ClassEntry):
    """A class with its quantum."""

    quantum: Bytes = Field(ge=1, le=1_000_000, description="bytes that it may send at a visit")


class RoundRobinEntry(Entry):
    """Classes that share the link."""

    discipline: Literal["deficit_round_robin"] = Field(description="which queue this is")
    classes: list[ShareEntry] = Field(
        min_length=2, max_length=8, description="waiting lines that are visited in turn"
    )

    @model_validator(mode="after")
    def _distinct(self) -> "RoundRobinEntry":
        check_marks(self.classes)
        return self

    def queue(self) -> Queue:
        """Return the discipline."""
        lines = tuple(entry.line(entry.quantum) for entry in self.classes)
        return DeficitRoundRobin(lines, tuple(frozenset(entry.dscp) for entry in self.classes))
