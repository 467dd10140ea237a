"""A federate's place in a HELICS federation, and the broker that the federates meet at.

The configuration rests on what HELICS 3.6.1 was measured to do: federates that are uninterruptible
with a time step of 1 ns get exactly the times that they ask for.
"""

import json
import sys
import time
from collections.abc import Mapping
from typing import Any

import helics

from tieline.cosim.conventions import BROKER_NAME, Place, broker_options
from tieline.cosim.exchange import PEER
from tieline.cosim.interfaces import ENDPOINTS
from tieline.cosim.strangers import Strangers
from tieline.cosim.wire import PART_LIMIT_BYTES
from tieline.errors import CosimError
from tieline.units import ns_to_seconds, seconds_to_ns

_ERROR_CODE = CosimError.exit_code
_LONGEST_REASON = 500
_LOOK_S = 0.02


class FederationEndedError(CosimError):
    """The federation ended before its time, for a reason that lies outside this federate."""


class HelicsLink:
    """A message federate with its endpoint for bundles, and others if it is configured so.

    Args:
        name: `grid` or `network`.
        config: the federate's HELICS configuration.
        members: how many federates the federation has.
        strangers: counts the messages that come from anybody else than the peer.

    Raises:
        FederationEndedError: the broker does not answer or refuses.
    """

    def __init__(
        self, name: str, config: Mapping[str, Any], members: int, strangers: Strangers
    ) -> None:
        self.limit_bytes = PART_LIMIT_BYTES.get(config["core_type"])
        self._name = name
        self._strangers = strangers
        self._peer = ENDPOINTS[PEER[name]]
        self._members = members
        try:
            self._federate = helics.helicsCreateMessageFederateFromConfig(json.dumps(config))
            self._core = helics.helicsFederateGetCore(self._federate)
            self._endpoint = helics.helicsFederateGetEndpoint(self._federate, ENDPOINTS[name])
        except helics.HelicsException as error:
            raise FederationEndedError(f"{name} could not join the federation: {error}") from error

    def start(self) -> None:
        """Wait until every federate has joined; time is then 0.

        Raises:
            FederationEndedError: the federation ended while waiting.
        """
        try:
            self._await_peers()
            helics.helicsFederateEnterExecutingMode(self._federate)
        except helics.HelicsException as error:
            raise FederationEndedError(f"the federation ended before it began: {error}") from error

    def request(self, at_ns: int) -> int:
        """Return the time granted for a request of `at_ns`, ns.

        Raises:
            FederationEndedError: a peer or the broker is gone or raised a global error.
        """
        try:
            granted_s = helics.helicsFederateRequestTime(self._federate, ns_to_seconds(at_ns))
        except helics.HelicsException as error:
            raise FederationEndedError(f"the federation ended: {error}") from error
        if granted_s >= helics.HELICS_TIME_MAXTIME:
            # So HELICS ends a federation under way that a further federate has tried to join.
            raise FederationEndedError(
                "the broker ended the federation before its time, as it does when a program of"
                " somebody else's tries to join a run under way"
            )
        return seconds_to_ns(granted_s)

    def send(self, data: bytes, at_ns: int) -> None:
        """Send a message that the peer gets once it is granted `at_ns` or later.

        Raises:
            FederationEndedError: the federation takes no more messages.
        """
        _send(self._endpoint, self._peer, data, at_ns)

    def receive(self) -> list[tuple[int, bytes]]:
        """Return what the peer has sent since the last call, as (stamp in ns, message).

        What comes from another endpoint is dropped and counted: a federate of somebody else's may
        send what it likes, but only the peer's word counts.
        """
        messages = []
        for source, stamp_ns, data in _received(self._endpoint):
            if source == self._peer:
                messages.append((stamp_ns, data))
            else:
                why = f"only {self._peer} may send there"
                self._strangers.drop(ENDPOINTS[self._name], source, data, why)
        return messages

    def endpoint(self, name: str) -> "Endpoint":
        """Return another endpoint that the configuration has."""
        return Endpoint(helics.helicsFederateGetEndpoint(self._federate, name))

    def fail(self, reason: str) -> None:
        """End the whole federation with `reason`, even while another thread waits in it."""
        # ASCII, since a cut inside a longer character would fail in whoever decodes it.
        text = reason.splitlines()[0].encode("ascii", "replace")[:_LONGEST_REASON]
        try:
            helics.helicsCoreGlobalError(self._core, _ERROR_CODE, text)
        except helics.HelicsException as error:
            # The federation may have ended on its own meanwhile: that is what was wanted.
            sys.stderr.write(f"could not tell the federation: {error}\n")

    def flush(self, wait_s: float) -> None:
        """Wait until the core has told the others; a process that exits at once tells nobody."""
        helics.helicsCoreWaitForDisconnect(self._core, round(wait_s * 1e3))

    def leave(self) -> None:
        """Leave a federation that has reached its end."""
        helics.helicsFederateDisconnect(self._federate)

    def _await_peers(self) -> None:
        # A federate that enters while the other is still registering leaves both waiting for ever
        # (inproc: one start in four; tcp: now and then), so each looks first whether all are there.
        query = helics.helicsCreateQuery("root", "federates")
        while helics.helicsCoreIsConnected(self._core):
            joined = helics.helicsQueryExecute(query, self._federate)
            if isinstance(joined, list) and len(joined) >= self._members:
                return
            time.sleep(_LOOK_S)
        raise FederationEndedError("the federation ended while waiting for the other federates")


class Endpoint:
    """An endpoint that hears from and speaks to whoever is named."""

    def __init__(self, endpoint: helics.HelicsEndpoint) -> None:
        self._endpoint = endpoint

    def send(self, to: str, data: bytes, at_ns: int) -> None:
        """Send a message that comes `at_ns`, or now where that has passed."""
        _send(self._endpoint, to, data, at_ns)

    def receive(self) -> list[tuple[str, int, bytes]]:
        """Return what has come since the last call, as (source, stamp in ns, message)."""
        return _received(self._endpoint)


class Broker:
    """The broker of one federation, run by this process.

    Args:
        place: where it listens.
        members: how many federates it waits for.

    Raises:
        CosimError: it could not listen there.
    """

    def __init__(self, place: Place, members: int) -> None:
        options = broker_options(place, members)
        self._broker = helics.helicsCreateBroker(place.core, BROKER_NAME, options)
        if not helics.helicsBrokerIsConnected(self._broker):
            raise CosimError(
                f"the {place.core} broker could not listen on {place.host}:{place.port}"
            )

    def wait(self, wait_s: float) -> bool:
        """Return whether the federation is over, after waiting for that at most `wait_s`."""
        return bool(helics.helicsBrokerWaitForDisconnect(self._broker, round(wait_s * 1e3)))


def bytes_of(message: Any) -> bytes:
    """Return what a HELICS message carries."""
    # helicsMessageGetBytes has a C declaration parsed for each new length, 4 ms a message.
    size_bytes = helics.helicsMessageGetByteCount(message)
    start = helics.helicsMessageGetBytesPointer(message)
    return bytes(helics.capi.ffi.buffer(start, size_bytes))


def _send(endpoint: helics.HelicsEndpoint, to: str, data: bytes, at_ns: int) -> None:
    try:
        helics.helicsEndpointSendBytesToAt(endpoint, data, to, ns_to_seconds(at_ns))
    except helics.HelicsException as error:
        raise FederationEndedError(f"the federation takes no more messages: {error}") from error


def _received(endpoint: helics.HelicsEndpoint) -> list[tuple[str, int, bytes]]:
    messages = []
    while helics.helicsEndpointHasMessage(endpoint):
        message = helics.helicsEndpointGetMessage(endpoint)
        stamp_ns = seconds_to_ns(helics.helicsMessageGetTime(message))
        messages.append((helics.helicsMessageGetSource(message), stamp_ns, bytes_of(message)))
    return messages
