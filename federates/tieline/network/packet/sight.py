"""Finds one packet in the kernel's memory."""

from tieline.network.packet.kinds import ARRIVAL, KINDS, items_of
from tieline.network.packet.memory import (
    END_FORKS,
    END_MEMBERS,
    FIRST_FORK,
    FIRST_HOP,
    FIRST_MEMBER,
    FLOW,
    HOP,
    HOP_PORT,
    IP_BYTES,
    NO_PORT,
    SEQUENCE,
    TAP_FLOW,
    TAP_HOP,
    TAP_SEQUENCE,
    TAP_TIME,
    TAPPED,
    TIME,
    Cells,
    Memory,
)


class Sight:
    """Where a packet of a PMU flow is.

    Args:
        memory: the kernel's.
        flow: the PMU flow.
        carrier: the flow whose packets carry it: itself, a tree, or a connection's segments.
        segment: the number of the packet in that flow; `NONE` as long as it is unknown.
    """

    def __init__(self, memory: Memory, flow: int, carrier: int, segment: int) -> None:
        self.carrier, self.segment = carrier, segment
        self._memory, self._flow = memory, flow

    def first_row(self) -> int:
        """Return the row of `hops` at which its packets enter."""
        return int(self._memory.table("flows")[self.carrier, FIRST_HOP])

    def row(self, row: int) -> int | None:
        """Return the row of `hops` that the packet takes at one: its link, or its branch's."""
        plan = self._memory.plans_of(row)
        if plan[HOP_PORT] >= 0:
            return row
        if plan[HOP_PORT] == NO_PORT:
            return None
        members = self._memory.table("members")
        for fork in range(int(plan[FIRST_FORK]), int(plan[END_FORKS])):
            target = int(self._memory.table("forks")[fork, 0])
            if target >= 0:
                branch = self._memory.plans_of(target)
                if self._flow in members[branch[FIRST_MEMBER] : branch[END_MEMBERS], 0]:
                    return target
        return None

    def slots(self, row: int) -> list[int]:
        """Return the slots of the packet on, or before, the link of a row of `hops`."""
        inside = self._memory.inside()
        own = self._memory.table("packets")[inside]
        is_it = (own[:, FLOW] == self.carrier) & (own[:, SEQUENCE] == self.segment)
        return [int(slot) for slot in inside[is_it & (own[:, HOP] == row)]]

    def ip_bytes(self, slot: int) -> int:
        """Return the bytes of the packet in a slot from the IPv4 header on."""
        return int(self._memory.table("packets")[slot, IP_BYTES])

    def new_taps(self) -> Cells:
        """Return what has been put on links since the records were last collected."""
        return self._memory.table("taps")[: self._memory.control[TAPPED]]

    def starts_ns(self, row: int) -> int | None:
        """Return when the packet's first bit is on a link, if the last event decided that."""
        taps = self.new_taps()
        own = (taps[:, TAP_FLOW] == self.carrier) & (taps[:, TAP_SEQUENCE] == self.segment)
        times = taps[own & (taps[:, TAP_HOP] == row), TAP_TIME]
        return int(times[-1]) if len(times) else None

    def reaches_ns(self, slot: int) -> int:
        """Return when the packet in a slot reaches the end of its link."""
        events = self._memory.events()
        return int(events[items_of(events) == KINDS * slot + ARRIVAL, TIME][0])
