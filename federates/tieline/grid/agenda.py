"""What is still to happen: timed changes, and events that wait for a condition."""

import heapq
from collections.abc import Callable, Sequence

from tieline.grid.conditions import Condition
from tieline.grid.events import Disturbance
from tieline.grid.topology import Change

Read = Callable[[Condition], float]
"""Returns the present value of a condition's quantity."""


class Agenda:
    """The events of a run, in the order in which they come due.

    An event with a condition waits from its instant on; it begins at the first step at which the
    condition has held without a break for as long as it asks, once.
    """

    def __init__(self, events: Sequence[Disturbance]) -> None:
        self._heap: list[tuple[int, int, Change]] = []
        self._entered = 0
        self._waiting = [event for event in events if event.condition is not None]
        self._since: dict[int, int] = {}
        for event in sorted(events, key=lambda item: item.tick):
            if event.condition is None:
                self._begin(event, event.tick)

    def next_stop(self, tick: int) -> int | None:
        """Return the next tick after `tick` at which something may happen; None for none."""
        stops = [entry[0] for entry in self._heap[:1]]
        stops += [max(event.tick, tick + 1) for event in self._waiting]
        return min(stops, default=None)

    def due(self, tick: int, read: Read) -> list[Change]:
        """Return the changes due by `tick`, conditions looked at now, in order."""
        for event in [event for event in self._waiting if event.tick <= tick]:
            self._look(event, tick, read)
        changes = []
        while self._heap and self._heap[0][0] <= tick:
            changes.append(heapq.heappop(self._heap)[2])
        return changes

    def _look(self, event: Disturbance, tick: int, read: Read) -> None:
        assert event.condition is not None
        if not event.condition.holds(read(event.condition)):
            self._since.pop(id(event), None)
            return
        since = self._since.setdefault(id(event), tick)
        if tick - since >= event.condition.hold_ticks:
            self._waiting.remove(event)
            self._begin(event, tick)

    def _begin(self, event: Disturbance, tick: int) -> None:
        for stage in event.stages:
            heapq.heappush(self._heap, (tick + stage.after, self._entered, stage.change))
            self._entered += 1
