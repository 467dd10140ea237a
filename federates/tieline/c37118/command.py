"""Header frames (6.5, Table 13) and command frames (6.6, Tables 14 and 15)."""

from dataclasses import dataclass

from tieline.c37118.constants import Command, FrameType
from tieline.c37118.prefix import Prefix, unwrap, wrap
from tieline.c37118.words import WordReader, pack_words
from tieline.errors import FrameError


@dataclass(frozen=True)
class CommandFrame:
    """A command to the stream that the prefix names.

    `command` is one of `Command`, or a user's own number; `extended` are bytes of the user's.
    """

    prefix: Prefix
    command: int
    extended: bytes = b""

    def to_bytes(self) -> bytes:
        """Return the frame.

        Raises:
            FrameError: a value does not fit its word.
        """
        if self.extended and self.command != Command.EXTENDED:
            raise FrameError(f"command {self.command} takes no extended frame")
        body = pack_words("H", [self.command], "CMD") + self.extended
        return wrap(FrameType.COMMAND, self.prefix, body)

    @classmethod
    def from_bytes(cls, data: bytes) -> "CommandFrame":
        """Return the frame that the bytes hold.

        Raises:
            FrameError: they are no sound command frame.
        """
        prefix, body = unwrap(FrameType.COMMAND, data)
        return cls(prefix, WordReader(body).integer("H"), body[2:])


@dataclass(frozen=True)
class HeaderFrame:
    """What people should know about a stream, as ASCII text."""

    prefix: Prefix
    text: str

    def to_bytes(self) -> bytes:
        """Return the frame.

        Raises:
            FrameError: the text is not ASCII or too long.
        """
        if not self.text.isascii():
            raise FrameError(f"a header must be ASCII (got {self.text!r})")
        return wrap(FrameType.HEADER, self.prefix, self.text.encode("ascii"))

    @classmethod
    def from_bytes(cls, data: bytes) -> "HeaderFrame":
        """Return the frame that the bytes hold.

        Raises:
            FrameError: they are no sound header frame.
        """
        prefix, body = unwrap(FrameType.HEADER, data)
        if not body.isascii():
            raise FrameError(f"the header of IDCODE {prefix.idcode} is not ASCII")
        return cls(prefix, body.decode("ascii"))
