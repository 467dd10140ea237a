"""Messages through HELICS's own filters, in a small federation inside one process.

It stands beside the federation of grid and network and knows nothing of it: an inproc broker and
core, and one federate that owns every endpoint and the filters on those that send.

A message is handed over at the first grant beyond its stamp, not at its stamp, and one stamped
before the last grant is stamped anew (HELICS 3.6.1, measured). So this federation is granted one
nanosecond more than it is asked for, messages go in one nanosecond late, and the filter's delay is
one shorter: each arrives with the stamp that the delay asks for, in time.

HELICS 3.6.1 draws the losses of `random_drop` from a generator of each thread that it seeds from
the operating system; there is no way to seed it, so no two runs lose the same messages.
"""

import uuid
from collections.abc import Sequence

import helics

from tieline.cosim.link import bytes_of
from tieline.cosim.process import signals_held
from tieline.errors import CosimError
from tieline.units import ns_to_seconds, seconds_to_ns

_OPTIONS = "--federates=1 --loglevel=warning"
_WAIT_MS = 1_000
_AHEAD_NS = 1


class FilteredMessages:
    """Endpoints that send through a delay filter and, if wanted, `random_drop`.

    Args:
        sources: names of the endpoints that send.
        destinations: names of those that receive.
        delay_ns: of the delay filter, above 0.
        drop_probability: of `random_drop`; 0 leaves the filter out.

    Raises:
        CosimError: HELICS could not start it.
    """

    def __init__(
        self,
        sources: Sequence[str],
        destinations: Sequence[str],
        delay_ns: int,
        drop_probability: float,
    ) -> None:
        self._now_ns = -1
        self._is_open = True
        name = f"filters-{uuid.uuid4().hex}"
        try:
            with signals_held():
                self._broker = helics.helicsCreateBroker("inproc", name, _OPTIONS)
                self._federate = _federate(name)
            self._sources = [self._endpoint(source) for source in sources]
            self._destinations = [self._endpoint(target) for target in destinations]
            self._names = list(destinations)
            delay_s = ns_to_seconds(delay_ns - _AHEAD_NS)
            self._filter(helics.HELICS_FILTER_TYPE_DELAY, "delay", delay_s, sources)
            if drop_probability > 0:
                kind = helics.HELICS_FILTER_TYPE_RANDOM_DROP
                self._filter(kind, "dropprob", drop_probability, sources)
            helics.helicsFederateEnterExecutingMode(self._federate)
        except helics.HelicsException as error:
            raise CosimError(
                f"the federation of HELICS's filters did not start: {error}"
            ) from error

    def send(self, source: int, datas: Sequence[bytes], at_ns: int) -> None:
        """Send one message to each destination at an instant that has not passed."""
        endpoint, at_s = self._sources[source], ns_to_seconds(at_ns + _AHEAD_NS)
        for name, data in zip(self._names, datas, strict=True):
            helics.helicsEndpointSendBytesToAt(endpoint, data, name, at_s)

    def run_until(self, until_ns: int) -> list[tuple[int, int, bytes]]:
        """Return (arrival in ns, destination, data) of what arrived up to `until_ns`.

        Raises:
            CosimError: HELICS grants another time, or none.
        """
        if until_ns > self._now_ns:
            try:
                asked_s = ns_to_seconds(until_ns + _AHEAD_NS)
                granted_s = helics.helicsFederateRequestTime(self._federate, asked_s)
            except helics.HelicsException as error:
                raise CosimError(f"the federation of HELICS's filters ended: {error}") from error
            if seconds_to_ns(granted_s) != until_ns + _AHEAD_NS:
                raise CosimError(f"HELICS granted {granted_s!r} s for a request of {asked_s!r} s")
            self._now_ns = until_ns
        arrived = []
        for number, endpoint in enumerate(self._destinations):
            while helics.helicsEndpointHasMessage(endpoint):
                message = helics.helicsEndpointGetMessage(endpoint)
                arrival_ns = seconds_to_ns(helics.helicsMessageGetTime(message))
                arrived.append((arrival_ns, number, bytes_of(message)))
        return arrived

    def close(self) -> None:
        """End the federation; again does nothing."""
        if not self._is_open:
            return
        self._is_open = False
        # Nothing is freed by hand: HELICS 3.6.1 then fails in the next federation of the process.
        helics.helicsFederateDisconnect(self._federate)
        helics.helicsBrokerWaitForDisconnect(self._broker, _WAIT_MS)

    def _endpoint(self, name: str) -> helics.HelicsEndpoint:
        return helics.helicsFederateRegisterGlobalEndpoint(self._federate, name)

    def _filter(self, kind: int, name: str, value: float, targets: Sequence[str]) -> None:
        made = helics.helicsFederateRegisterGlobalFilter(self._federate, kind, f"filter-{name}")
        helics.helicsFilterSet(made, name, value)
        for target in targets:
            helics.helicsFilterAddSourceTarget(made, target)


def _federate(name: str) -> helics.HelicsMessageFederate:
    info = helics.helicsCreateFederateInfo()
    helics.helicsFederateInfoSetCoreTypeFromString(info, "inproc")
    helics.helicsFederateInfoSetCoreInitString(info, f"{_OPTIONS} --broker={name}")
    helics.helicsFederateInfoSetFlagOption(info, helics.HELICS_FLAG_UNINTERRUPTIBLE, True)
    helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_DELTA, 1e-9)
    return helics.helicsCreateMessageFederate(name, info)
