"""What disciplines with several lines share: which packets wait in which."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.queues.base import NO_LIMIT, WaitingLine
from tieline.network.queues.drop_tail import MOST_BYTES, MOST_PACKETS
from tieline.units import Bytes, Unit

MOST_DSCP = 63


def line_of(dscp: int, marks: Sequence[frozenset[int]]) -> int:
    """Return the first line that takes a DSCP; the last takes what no other does."""
    for number, own in enumerate(marks[:-1]):
        if dscp in own:
            return number
    return len(marks) - 1


class ClassEntry(Entry):
    """A waiting line, and the DSCPs of the packets that wait in it."""

    dscp: list[Annotated[int, Unit("number")]] = Field(
        [],
        description="marks, 0 to 63, of the packets of this class; the last class takes all others",
    )
    packets: Annotated[int, Unit("packets")] = Field(
        ge=1, le=MOST_PACKETS, strict=True, description="the most packets that may wait"
    )
    bytes: Bytes | None = Field(
        None, ge=1, le=MOST_BYTES, description="the most bytes that may wait; none: no limit"
    )

    @model_validator(mode="after")
    def _known(self) -> "ClassEntry":
        if not all(0 <= mark <= MOST_DSCP for mark in self.dscp):
            raise ValueError(f"'dscp' must be >= 0 and <= {MOST_DSCP} (got {self.dscp})")
        return self

    def line(self, quantum_bytes: int = 0) -> WaitingLine:
        """Return the waiting line."""
        return WaitingLine(self.packets, self.bytes or NO_LIMIT, quantum_bytes)


def check_marks(classes: Sequence[ClassEntry]) -> None:
    """Raise ValueError unless each class but the last has DSCPs, each DSCP in one class alone."""
    marks = [mark for entry in classes for mark in entry.dscp]
    twice = sorted({mark for mark in marks if marks.count(mark) > 1})
    if twice:
        raise ValueError(f"dscp {twice[0]} is in two classes")
    if any(not entry.dscp for entry in classes[:-1]):
        raise ValueError("every class but the last needs a 'dscp'")
