"""Lines of JSON between the hosts of one run: who may join, how it goes, and why it ends.

They go over one TCP connection a side, to the port beside HELICS's. They are not encrypted, no more
than HELICS's own. With a key each side proves to the other that it has it before anything starts.
"""

import collections
import importlib.metadata
import json
import select
import socket
import time
from collections.abc import Iterator, Mapping
from typing import Any

import tieline
from tieline.errors import CosimError, InputError
from tieline.experiment.plan import PlannedRun

FORMAT = "tieline-join/1"

_SEND_S = 2.0
_QUIET_S = 5.0
_ALIVE_S = 1.0
_READ_BYTES = 65_536
_LONGEST_LINE_BYTES = 1_000_000

Message = dict[str, Any]


class Wire:
    """One end of a connection between two hosts; it never blocks for long.

    Attributes:
        lost: why nothing more can come, None while it can.
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.settimeout(_SEND_S)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection = connection
        self._rest = b""
        self._come: collections.deque[Message] = collections.deque()
        self._heard_s = self._sent_s = time.monotonic()
        self.lost: str | None = None

    @property
    def own_address(self) -> str:
        """The address of this host at which the other one reaches it."""
        return str(self._connection.getsockname()[0])

    @property
    def other_address(self) -> str:
        """The other host's address."""
        return str(self._connection.getpeername()[0])

    def fileno(self) -> int:
        """Return the descriptor, to wait for."""
        return self._connection.fileno()

    def send(self, message: Mapping[str, Any]) -> None:
        """Send one line; where nobody listens any more, that is `lost`."""
        try:
            self._connection.sendall(json.dumps(message).encode() + b"\n")
            self._sent_s = time.monotonic()
        except OSError as error:
            self.lost = self.lost or f"the connection ended ({error})"

    def read(self) -> Iterator[Message]:
        """Yield the lines that have come; those not taken stay for the next reader."""
        self._receive()
        while self._come:
            yield self._come.popleft()

    def _receive(self) -> None:
        while self.lost is None and select.select([self._connection], [], [], 0)[0]:
            try:
                data = self._connection.recv(_READ_BYTES)
            except OSError as error:
                self.lost = f"the connection ended ({error})"
                return
            if not data:
                self.lost = "the connection ended"
                return
            self._heard_s = time.monotonic()
            *lines, self._rest = (self._rest + data).split(b"\n")
            if len(self._rest) > _LONGEST_LINE_BYTES:
                self.lost = "a line without end came"
            for line in lines:
                self._take(line)

    def wait(self, wait_s: float) -> Message:
        """Return the next line.

        Raises:
            CosimError: none comes in `wait_s`.
        """
        limit = time.monotonic() + wait_s
        while True:
            for message in self.read():
                if message:
                    return message
            if time.monotonic() > limit or self.lost is not None:
                break
            select.select([self._connection], [], [], min(_ALIVE_S, wait_s))
            self.keep_alive()
        raise CosimError(self.lost or f"no answer for {wait_s:g} s")

    def keep_alive(self) -> None:
        """Let the other end hear something, and notice when it has been quiet for long."""
        now_s = time.monotonic()
        if now_s - self._sent_s > _ALIVE_S:
            self.send({})
        if now_s - self._heard_s > _QUIET_S:
            self.lost = self.lost or f"nothing was heard of it for {_QUIET_S:g} s"

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _take(self, line: bytes) -> None:
        try:
            message = json.loads(line)
        except (ValueError, RecursionError):
            message = None
        if isinstance(message, dict):
            self._come.append(message)
        else:
            self.lost = f"something came that is not tieline's: {line[:40]!r}"


def hello(planned: PlannedRun, federate: str) -> Message:
    """Return how a federate introduces itself, or the broker knows what to expect of it."""
    return {
        "format": FORMAT,
        "federate": federate,
        "tieline": tieline.__version__,
        "helics": importlib.metadata.version("helics"),
        "config": planned.run["config_hash"],
        **{f"files of {name}": digest for name, digest in planned.inputs.items()},
    }


def refusal(own: Message, theirs: Message) -> str | None:
    """Return why somebody may not join, with what both sides have; None if they may."""
    if theirs.get("format") != own["format"]:
        return f"another way of joining: {theirs.get('format')!r} here is {own['format']!r}"
    words = [
        f"{name} {_short(theirs.get(name))} there, {_short(own.get(name))} at the broker"
        for name in sorted({*own, *theirs} - {"format", "federate", "nonce"})
        if own.get(name) != theirs.get(name)
    ]
    if words:
        return f"{theirs.get('federate')} is of another run or version: {'; '.join(words)}"
    return None


def _short(value: object) -> str:
    return "none" if value is None else str(value)[:12]


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Raises:
        InputError: it cannot listen there.
    """
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()
    except OSError as error:
        listener.close()
        raise InputError(f"cannot listen on {host}:{port}: {error.strerror or error}") from error
    return listener


def connect(host: str, port: int, wait_s: float) -> Wire:
    """Return a connection to a broker, which may still have to be started.

    Raises:
        InputError: the name is unknown.
        CosimError: nobody answers in `wait_s`.
    """
    limit = time.monotonic() + wait_s
    while True:
        try:
            return Wire(socket.create_connection((host, port), timeout=_SEND_S))
        except socket.gaierror as error:
            raise InputError(f"--broker {host}: {error.strerror}") from error
        except OSError as error:
            if time.monotonic() > limit:
                raise CosimError(f"no broker at {host}:{port} for {wait_s:g} s: {error}") from error
            time.sleep(0.2)
