"""How bundles become HELICS messages, and how both ends prove that none is lost."""

import hashlib
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from tieline.errors import CosimError

PART_LIMIT_BYTES = {"tcp": 3_800}
"""Longest message of a core, header included; HELICS 3.6.1 loses longer ones on tcp silently."""

TOGETHER_BYTES = 500_000
"""Longest message of the other cores, header included; twice as much was measured to pass."""

_PART = struct.Struct("<4sBIHHI")
_MAGIC = b"TLM2"
_TOTALS = struct.Struct("<QQ32s")


class Kind(IntEnum):
    """What a message holds."""

    BUNDLE = 0
    END = 1


@dataclass(frozen=True)
class Part:
    """Part `index` of `count` of the bundle or end marker with number `k`."""

    kind: Kind
    k: int
    index: int
    count: int
    body: bytes


def split(kind: Kind, k: int, payload: bytes, limit_bytes: int | None) -> list[bytes]:
    """Return the messages that carry `payload`.

    None is longer than `limit_bytes` (None: `TOGETHER_BYTES`).
    """
    room = (TOGETHER_BYTES if limit_bytes is None else limit_bytes) - _PART.size
    count = max(1, -(-len(payload) // room))
    bodies = (payload[index * room : (index + 1) * room] for index in range(count))
    return [
        _PART.pack(_MAGIC, kind, k, index, count, len(body)) + body
        for index, body in enumerate(bodies)
    ]


def put_together(messages: Iterable[bytes], limit_bytes: int | None) -> list[bytes]:
    """Return fewer messages that say the same in the same order; what HELICS does costs by message.

    None of several is longer than `limit_bytes` (None: `TOGETHER_BYTES`).
    """
    limit = TOGETHER_BYTES if limit_bytes is None else limit_bytes
    groups: list[list[bytes]] = []
    size = limit
    for message in messages:
        size += len(message)
        if size > limit:
            groups.append([])
            size = len(message)
        groups[-1].append(message)
    return [b"".join(group) for group in groups]


def read_parts(data: bytes) -> list[Part]:
    """Return what one HELICS message holds.

    Raises:
        CosimError: it is no message of tieline.
    """
    parts: list[Part] = []
    at = 0
    while at < len(data) or not parts:
        if len(data) - at < _PART.size or data[at : at + len(_MAGIC)] != _MAGIC:
            raise CosimError(
                f"a message of {len(data)} bytes is not tieline's: it has {data[at : at + 8]!r}"
                f" at byte {at}"
            )
        _, kind, k, index, count, size = _PART.unpack_from(data, at)
        at += _PART.size + size
        if kind not in tuple(Kind) or index >= count or at > len(data):
            raise CosimError(
                f"a message of kind {kind} calls itself part {index} of {count}, to byte {at} of"
                f" {len(data)}"
            )
        parts.append(Part(Kind(kind), k, index, count, data[at - size : at]))
    return parts


def join(parts: Iterable[Part]) -> bytes:
    """Return the payload that the parts of one bundle or end marker carry, in whatever order.

    Raises:
        CosimError: a part is missing, comes twice, or is of another bundle.
    """
    ordered = sorted(parts, key=lambda part: part.index)
    expected = ordered[0].count
    found = [part.index for part in ordered]
    if found != list(range(expected)) or any(part.count != expected for part in ordered):
        raise CosimError(f"a bundle of {expected} parts came as parts {found}")
    return b"".join(part.body for part in ordered)


@dataclass
class Ledger:
    """What went through one direction so far: messages, bytes and a running SHA-256."""

    messages: int = 0
    size_bytes: int = 0
    _hash: Any = field(default_factory=hashlib.sha256, repr=False)

    def add(self, payload: bytes) -> None:
        """Count one more message."""
        self.messages += 1
        self.size_bytes += len(payload)
        # The length keeps two messages apart from one that joins them.
        self._hash.update(struct.pack("<Q", len(payload)))
        self._hash.update(payload)

    @property
    def sha256(self) -> str:
        """The running hash, in hexadecimal digits."""
        return str(self._hash.hexdigest())

    def to_bytes(self) -> bytes:
        """Return the end marker's payload."""
        return _TOTALS.pack(self.messages, self.size_bytes, self._hash.digest())

    def check(self, end_marker: bytes, sender: str) -> None:
        """Compare what was received with what `sender` says that it sent.

        Raises:
            CosimError: the counts or the hashes differ.
        """
        if end_marker == self.to_bytes():
            return
        if len(end_marker) != _TOTALS.size:
            raise CosimError(f"the end marker of {sender} has {len(end_marker)} bytes")
        messages, size_bytes, digest = _TOTALS.unpack(end_marker)
        raise CosimError(
            f"{sender} sent {messages} messages, {size_bytes} bytes, SHA-256 {digest.hex()[:16]}; "
            f"received {self.messages} messages, {self.size_bytes} bytes, {self.sha256[:16]}"
        )
