"""Packs and takes the big-endian words of a frame's body, and says which one does not fit."""

import struct
from collections.abc import Sequence

from tieline.errors import FrameError

_NAME_BYTES = 16


def pack_words(layout: str, values: Sequence[float], what: str) -> bytes:
    """Return `values` as big-endian words of one `struct` code (`H`, `h`, `I`, `i` or `f`).

    Raises:
        FrameError: a value does not fit; the message names `what` and the values.
    """
    try:
        return struct.pack(f">{len(values)}{layout}", *values)
    except (struct.error, OverflowError) as error:
        raise FrameError(f"{what} {list(values)} does not fit its words: {error}") from error


def pack_names(texts: Sequence[str]) -> bytes:
    """Return `texts` as 16-byte ASCII fields, padded with blanks (Table 9, STN and CHNAM).

    Raises:
        FrameError: a name is longer than 16 characters or not ASCII.
    """
    for text in texts:
        if len(text) > _NAME_BYTES or not text.isascii():
            raise FrameError(
                f"a name must have at most {_NAME_BYTES} ASCII characters (got {text!r})"
            )
    return b"".join(text.encode("ascii").ljust(_NAME_BYTES) for text in texts)


class WordReader:
    """Takes words off the front of a frame's body; every method raises FrameError past its end."""

    def __init__(self, body: bytes) -> None:
        self._body = body
        self._at = 0

    def integers(self, code: str, count: int) -> tuple[int, ...]:
        """Return `count` integers of one `struct` code."""
        return self._words(code, count)

    def integer(self, code: str) -> int:
        """Return one integer of a `struct` code."""
        return self.integers(code, 1)[0]

    def numbers(self, code: str, count: int) -> tuple[float, ...]:
        """Return `count` numbers of one `struct` code, integer or float."""
        return self._words(code, count)

    def names(self, count: int) -> tuple[str, ...]:
        """Return `count` names of 16 bytes, without the blanks that pad them."""
        fields = [self.take(_NAME_BYTES) for _ in range(count)]
        for field in fields:
            if not field.isascii():
                raise FrameError(f"a name must be ASCII (got {field!r})")
        return tuple(field.decode("ascii").rstrip(" \0") for field in fields)

    def take(self, count: int) -> bytes:
        """Return the next `count` bytes."""
        left = len(self._body) - self._at
        if count > left:
            raise FrameError(f"the frame ends {count - left} bytes before its last word")
        self._at += count
        return self._body[self._at - count : self._at]

    def finish(self) -> None:
        """Check that nothing is left."""
        left = len(self._body) - self._at
        if left:
            raise FrameError(f"the frame has {left} bytes after its last word")

    def _words(self, code: str, count: int) -> tuple[int, ...]:
        layout = struct.Struct(f">{count}{code}")
        return layout.unpack(self.take(layout.size))
