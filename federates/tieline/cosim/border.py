"""What the grid holds against every bundle of deliveries before it applies one of them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_in_place
from tieline.cosim.interfaces import GRID, Clock, DeliveryBundle
from tieline.errors import CosimError, TimeContractBroken
from tieline.units import NS_PER_S, ns_to_seconds

FRAMES_REMEMBERED = 1_024
"""How many of the newest frames are remembered by what was delivered of them; 17 s at 60 a second.
The network itself counts every packet's end once, however old it is."""

_SOUND = -1
_OUTSIDE, _DISORDER, _TWICE, _BEFORE_MEASURED, _NOT_MEASURED, _NOWHERE = range(6)

Numbers = NDArray[np.int64]


class DeliveryBorder:
    """Checks that deliveries come in their interval, in order, once, and after their measurement.

    Args:
        clock: of the run.
        sources, destinations: how many PMUs and controllers there are.
    """

    def __init__(self, clock: Clock, sources: int, destinations: int) -> None:
        self._clock = clock
        self._next = 0
        self._is_delivered = np.zeros((FRAMES_REMEMBERED, sources, destinations), np.bool_)
        # Compiles, where that is still to be done, before the federation waits for an answer.
        none = np.empty(0, np.int64)
        _fault(none, none, none, none, 0, 0, 0, 0, clock.rate_hz, self._is_delivered)

    def check(self, k: int, bundle: DeliveryBundle) -> None:
        """Refuse the bundle of the stride that begins at t_k if anything in it breaks the contract.

        Raises:
            TimeContractBroken: a stride is left out or comes again, the bundle is stamped with
                another instant than its end, or a delivery arrives outside it, out of the order
                (arrival, source, sequence, destination), twice, or before its frame was measured,
                or its frame is measured after the stride's begin.
            CosimError: a delivery names a PMU or a controller that there is not.
        """
        if k != self._next:
            raise TimeContractBroken(
                f"{GRID}: the deliveries of interval {k} came for interval {self._next}"
            )
        self._next = self._clock.next_meeting(k)
        since_ns, until_ns = self._clock.at_ns(k), self._clock.at_ns(self._next)
        if bundle.until_ns != until_ns:
            raise TimeContractBroken(
                f"{GRID}: the deliveries of interval {k} are stamped {bundle.until_ns} ns,"
                f" which must be {until_ns} ns"
            )
        self._is_delivered[np.arange(k, self._next) % FRAMES_REMEMBERED] = False
        columns = bundle.columns
        place, fault = _fault(
            columns.arrival_ns,
            columns.source,
            columns.destination,
            columns.sequence,
            k,
            self._next - FRAMES_REMEMBERED,
            since_ns,
            until_ns,
            self._clock.rate_hz,
            self._is_delivered,
        )
        if place != _SOUND:
            self._refuse(k, bundle.records, int(place), int(fault))

    def _refuse(self, k: int, records: NDArray[np.void], place: int, fault: int) -> None:
        record: Any = records[place]
        arrival_ns, sequence = int(record["arrival_ns"]), int(record["sequence"])
        since_ns, until_ns = self._clock.at_ns(k), self._clock.at_ns(self._next)
        what = (
            f"{GRID}, interval {k}: delivery {place} of {len(records)}, frame {sequence} of PMU "
            f"{record['source']} to controller {record['destination']}, at {arrival_ns} ns"
        )
        measured_ns = self._clock.at_ns(sequence)
        before_ns = int(records[place - 1]["arrival_ns"])
        sentence = {
            _OUTSIDE: f" came for the interval from {since_ns} to {until_ns} ns",
            _DISORDER: f" stands behind one at {before_ns} ns, out of order",
            _TWICE: ", has been delivered before",
            _BEFORE_MEASURED: f", was measured only at {measured_ns} ns",
            _NOT_MEASURED: f", is measured at {measured_ns} ns, after the interval's begin",
            _NOWHERE: ", knows no such PMU or controller",
        }[fault]
        broken = CosimError if fault == _NOWHERE else TimeContractBroken
        raise broken(what + sentence)


def check_stamps(name: str, clock: Clock, k: int, arrivals_ns: NDArray[np.integer[Any]]) -> None:
    """Refuse packets whose arrivals cannot be stamps of messages sent in interval k.

    Raises:
        TimeContractBroken: one lies outside [t_k, t_k+1].
    """
    since_ns, until_ns = clock.at_ns(k), clock.at_ns(k + 1)
    if len(arrivals_ns) and not since_ns <= arrivals_ns.min() <= arrivals_ns.max() <= until_ns:
        raise TimeContractBroken(
            f"{name}: packets for guests arrive at {ns_to_seconds(int(arrivals_ns.min())):.9f} to "
            f"{ns_to_seconds(int(arrivals_ns.max())):.9f} s, outside interval {k} from "
            f"{ns_to_seconds(since_ns):.9f} to {ns_to_seconds(until_ns):.9f} s"
        )


@compiled_in_place
def _fault(
    arrival_ns: Numbers,
    source: Numbers,
    destination: Numbers,
    sequence: Numbers,
    k: int,
    oldest: int,
    since_ns: int,
    until_ns: int,
    rate_hz: int,
    is_delivered: NDArray[np.bool_],
) -> tuple[int, int]:
    """Return the first delivery (of r, each column (r,)) that is at fault and its fault, or -1.

    Sound ones are noted in `is_delivered` (frames, sources, destinations), which remembers the
    frames from `oldest` on.
    """
    remembered, sources, destinations = is_delivered.shape
    for i in range(len(arrival_ns)):
        at, number = arrival_ns[i], sequence[i]
        if not 0 <= source[i] < sources or not 0 <= destination[i] < destinations:
            return i, _NOWHERE
        if not since_ns <= at <= until_ns:
            return i, _OUTSIDE
        if at < number * NS_PER_S // rate_hz:
            return i, _BEFORE_MEASURED
        if number > k:
            return i, _NOT_MEASURED
        if i > 0 and at <= arrival_ns[i - 1]:
            later = at - arrival_ns[i - 1]
            if later == 0:
                later = source[i] - source[i - 1]
            if later == 0:
                later = number - sequence[i - 1]
            if later == 0:
                later = destination[i] - destination[i - 1]
            if later < 0:
                return i, _DISORDER
            if later == 0:
                return i, _TWICE
        if number >= oldest:
            row = number % remembered
            if is_delivered[row, source[i], destination[i]]:
                return i, _TWICE
            is_delivered[row, source[i], destination[i]] = True
    return _SOUND, _SOUND
