"""Queue disciplines, one a file; `QUEUES` are the names that a topology file may use."""

from typing import Annotated

from pydantic import Field

from tieline.network.entry import Entry
from tieline.network.queues.base import EarlyDetection, Queue, WaitingLine
from tieline.network.queues.drop_tail import DropTail, DropTailEntry
from tieline.network.queues.early_detection import EarlyDetectionEntry, RandomEarlyDetection
from tieline.network.queues.priority import PriorityEntry, StrictPriority
from tieline.network.queues.round_robin import DeficitRoundRobin, RoundRobinEntry

__all__ = [
    "QUEUES",
    "DeficitRoundRobin",
    "DropTail",
    "EarlyDetection",
    "Queue",
    "QueueEntry",
    "RandomEarlyDetection",
    "StrictPriority",
    "WaitingLine",
]

QUEUES: dict[str, type[Entry]] = {
    "drop_tail": DropTailEntry,
    "priority": PriorityEntry,
    "deficit_round_robin": RoundRobinEntry,
    "red": EarlyDetectionEntry,
}
QueueEntry = Annotated[
    DropTailEntry | PriorityEntry | RoundRobinEntry | EarlyDetectionEntry,
    Field(discriminator="discipline"),
]
