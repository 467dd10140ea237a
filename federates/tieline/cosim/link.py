"""A federate's place in a HELICS federation, and the broker that the federates meet at.

The settings rest on what HELICS 3.6.1 was measured to do: both federates uninterruptible with a
time step of 1 ns get exactly the times that they ask for, and a tick of 500 ms with a timeout of
2 s notices a lost peer in 2 to 3 s, where the defaults take half a minute.
"""

import sys
import time
from typing import Any

import helics

from tieline.cosim.exchange import PEER
from tieline.cosim.interfaces import ENDPOINTS, FEDERATES
from tieline.cosim.wire import PART_LIMIT_BYTES
from tieline.errors import CosimError
from tieline.units import ns_to_seconds, seconds_to_ns

BROKER_NAME = "tieline"
_HOST = "127.0.0.1"
_WATCH = "--tick=500ms --timeout=2s --loglevel=warning"
_ERROR_CODE = CosimError.exit_code
_LONGEST_REASON = 500
_LOOK_S = 0.02


class FederationEndedError(CosimError):
    """The federation ended before its time, for a reason that lies outside this federate."""


class HelicsLink:
    """A message federate with one endpoint.

    Args:
        name: `grid` or `network`.
        core: `zmq`, `tcp` or `inproc`.
        broker_port: where the broker listens; None for inproc.
        connect_s: longest wait for the broker, s.

    Raises:
        FederationEndedError: the broker does not answer or refuses.
    """

    def __init__(self, name: str, core: str, broker_port: int | None, connect_s: float) -> None:
        self.limit_bytes = PART_LIMIT_BYTES.get(core)
        self._peer = ENDPOINTS[PEER[name]]
        info = helics.helicsCreateFederateInfo()
        helics.helicsFederateInfoSetCoreTypeFromString(info, core)
        helics.helicsFederateInfoSetCoreInitString(info, _core_options(broker_port, connect_s))
        helics.helicsFederateInfoSetFlagOption(info, helics.HELICS_FLAG_UNINTERRUPTIBLE, True)
        helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_DELTA, 1e-9)
        try:
            self._federate = helics.helicsCreateMessageFederate(name, info)
            self._core = helics.helicsFederateGetCore(self._federate)
            self._endpoint = helics.helicsFederateRegisterGlobalEndpoint(
                self._federate, ENDPOINTS[name]
            )
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
        return seconds_to_ns(granted_s)

    def send(self, data: bytes, at_ns: int) -> None:
        """Send a message that the peer gets once it is granted `at_ns` or later.

        Raises:
            FederationEndedError: the federation takes no more messages.
        """
        try:
            helics.helicsEndpointSendBytesToAt(
                self._endpoint, data, self._peer, ns_to_seconds(at_ns)
            )
        except helics.HelicsException as error:
            raise FederationEndedError(f"the federation takes no more messages: {error}") from error

    def receive(self) -> list[tuple[int, bytes]]:
        """Return what has come since the last call, as (stamp in ns, message)."""
        messages = []
        while helics.helicsEndpointHasMessage(self._endpoint):
            message = helics.helicsEndpointGetMessage(self._endpoint)
            stamp_ns = seconds_to_ns(helics.helicsMessageGetTime(message))
            messages.append((stamp_ns, bytes_of(message)))
        return messages

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
            if isinstance(joined, list) and len(joined) >= len(FEDERATES):
                return
            time.sleep(_LOOK_S)
        raise FederationEndedError("the federation ended while waiting for the other federates")


class Broker:
    """The broker of one federation, run by this process on the loopback interface.

    Args:
        core: `zmq`, `tcp` or `inproc`.
        port: where to listen; None for inproc.

    Raises:
        CosimError: it could not listen there.
    """

    def __init__(self, core: str, port: int | None) -> None:
        where = "" if port is None else f" --port={port} --local_interface={_HOST}"
        options = f"--federates={len(FEDERATES)}{where} {_WATCH}"
        self._broker = helics.helicsCreateBroker(core, BROKER_NAME, options)
        if not helics.helicsBrokerIsConnected(self._broker):
            raise CosimError(f"the {core} broker could not listen on {_HOST}:{port}")

    def wait(self, wait_s: float) -> bool:
        """Return whether the federation is over, after waiting for that at most `wait_s`."""
        return bool(helics.helicsBrokerWaitForDisconnect(self._broker, round(wait_s * 1e3)))


def bytes_of(message: Any) -> bytes:
    """Return what a HELICS message carries."""
    # helicsMessageGetBytes has a C declaration parsed for each new length, 4 ms a message.
    size_bytes = helics.helicsMessageGetByteCount(message)
    start = helics.helicsMessageGetBytesPointer(message)
    return bytes(helics.capi.ffi.buffer(start, size_bytes))


def _core_options(broker_port: int | None, connect_s: float) -> str:
    options = f"--federates=1 {_WATCH} --networktimeout={round(connect_s * 1e3)}ms"
    if broker_port is None:
        return f"{options} --broker={BROKER_NAME}"
    return f"{options} --brokeraddress={_HOST} --brokerport={broker_port}"
