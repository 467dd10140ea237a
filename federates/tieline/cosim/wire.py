"""How a bundle becomes one HELICS message or several, and how both ends prove that none is lost."""

import hashlib
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from tieline.errors import CosimError

PART_LIMIT_BYTES = {"tcp": 3_800}
"""Longest message of a core, header included; HELICS 3.6.1 loses longer ones on tcp silently."""

_PART = struct.Struct("<4sBIHH")
_MAGIC = b"TLM1"
_TOTALS = struct.Struct("<QQ32s")


class Kind(IntEnum):
    """What a message holds."""

    BUNDLE = 0
    END = 1


@dataclass(frozen=True)
class Part:
    """One HELICS message: part `index` of `count` of the bundle or end marker with number `k`."""

    kind: Kind
    k: int
    index: int
    count: int
    body: bytes


def split(kind: Kind, k: int, payload: bytes, limit_bytes: int | None) -> list[bytes]:
    """Return the messages that carry `payload`, none longer than `limit_bytes` (None: no limit)."""
    room = max(len(payload), 1) if limit_bytes is None else limit_bytes - _PART.size
    count = max(1, -(-len(payload) // room))
    return [
        _PART.pack(_MAGIC, kind, k, index, count) + payload[index * room : (index + 1) * room]
        for index in range(count)
    ]


def read_part(data: bytes) -> Part:
    """Return what one HELICS message holds.

    Raises:
        CosimError: it is no message of tieline.
    """
    if len(data) < _PART.size or data[:4] != _MAGIC:
        raise CosimError(f"a message of {len(data)} bytes is not tieline's: it begins {data[:8]!r}")
    _, kind, k, index, count = _PART.unpack_from(data)
    if kind not in tuple(Kind) or index >= count:
        raise CosimError(f"a message of kind {kind} calls itself part {index} of {count}")
    return Part(Kind(kind), k, index, count, data[_PART.size :])


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
