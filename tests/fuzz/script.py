"""Bytes as a list of decisions: how a fuzzer's input breaks something that was whole.

A fuzzer that only writes noise never comes past the first check of a format. Each target therefore
takes its input as decisions: which sound thing to begin with, where to change it, and into what.
"""

import atexit
import functools
import itertools
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

Place = tuple[Any, str | int]

NASTY_BYTES = (
    b"", b"\0", b"\xff", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\r", b"\x1b[2J", b"A" * 300,
    b"\x00\x00\x00\x00", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x80\x00\x00\x00",
    b"\x7f\x80\x00\x00", b"\x7f\xc0\x00\x00", b"\xff\x80\x00\x00", b"\x00\x00\x80\x7f",
)  # fmt: skip
"""Bytes that readers stumble over: ends, infinities and NaNs in either byte order."""

NASTY_TEXTS = (
    "", " ", "0", "-1", "1e308", "1e400", "-0", "nan", ".nan", ".inf", "-.inf", "5e-324", "\0",
    "\ud7ff", "²", "1_0", "0x" + "f" * 4500, "9" * 5000, "1:" * 900 + "1", "2001-01-01", "null",
    "~", "yes", "[]", "{}", "[[[", "&a [*a]", "*b", "!!binary x", "!!set {a}", "<<", "../..",
    "/dev/zero", "/dev/null", "/etc/passwd", "~root", "a" * 300, "x/" * 200, "10 ms", "1e300 s",
    "5 parsec", "-3 Mbit/s", "{config}", "%s", "\n", "\t", "#", "'", '"', ",", ":", "- ", "é",
)  # fmt: skip
"""Words that readers stumble over."""

NASTY_VALUES: tuple[Any, ...] = (
    *NASTY_TEXTS, None, True, False, 0, -1, 1, 2**31, 2**63, 2**64, 10**20, -(10**20), 1e308,
    5e-324, float("nan"), float("inf"), [], {}, [[]], [{}], {"a": 1}, {1: 2}, {None: None},
    [None] * 3, ["x"] * 1000,
)  # fmt: skip


class Script:
    """The decisions that a fuzzer's bytes stand for; when they are used up, all are 0."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def is_over(self) -> bool:
        """Whether nothing is left."""
        return self._at >= len(self._data)

    def take(self, most: int) -> bytes:
        """Return the next bytes, at most so many."""
        taken = self._data[self._at : self._at + most]
        self._at += most
        return taken

    def rest(self) -> bytes:
        """Return all that is left."""
        return self.take(len(self._data))

    def below(self, bound: int) -> int:
        """Return a number from 0 to `bound` - 1."""
        return int.from_bytes(self.take(2 if bound <= 1 << 16 else 4), "little") % max(bound, 1)

    def one(self, choices: Any) -> Any:
        """Return one of several things."""
        return choices[self.below(len(choices))]

    def rounds(self, most: int = 8) -> Iterator[int]:
        """Yield numbers until nothing is left, at least one and at most so many."""
        for number in range(most):
            if number and self.is_over:
                return
            yield number


def edited(whole: bytes, script: Script) -> bytes:
    """Return bytes with some of them cut out, doubled, overwritten, flipped or put in."""
    data = bytearray(whole)
    for _ in script.rounds():
        deed, at = script.below(6), script.below(len(data) + 1)
        piece = script.take(1 + script.below(8)) if deed < 3 else script.one(NASTY_BYTES)
        if deed in (0, 3):
            data[at : at + len(piece)] = piece
        elif deed in (1, 4):
            data[at:at] = piece
        elif deed == 2:
            del data[at : at + 1 + script.below(40)]
        elif at < len(data):
            data[at] ^= 1 << script.below(8)
    return bytes(data)


def edited_text(whole: str, script: Script) -> bytes:
    """Return a text with characters and words cut out, doubled or replaced, as UTF-8."""
    text = whole
    for _ in script.rounds():
        deed, at = script.below(5), script.below(len(text) + 1)
        until = at + 1 + script.below(12)
        if deed == 0:
            text = text[:at] + script.take(1 + script.below(4)).decode("latin-1") + text[at:]
        elif deed == 1:
            text = text[:at] + script.one(NASTY_TEXTS) + text[until:]
        elif deed == 2:
            text = text[:at] + text[until:]
        elif deed == 3:
            text = text[:until] + text[at:]
        else:
            text = text[: max(at, 1)]
    return text.encode("utf-8", "surrogatepass")


def edited_tree(data: Any, script: Script) -> Any:
    """Return groups and lists with members removed, renamed, doubled or replaced, changed in place.

    The tree is the caller's own; what it holds more than once is changed once.
    """
    for _ in script.rounds():
        # A tree that holds itself several times has more places than there is time for.
        places = list(itertools.islice(_places(data), 2_000))
        if not places:
            return data
        group, key = script.one(places)
        deed = script.below(5)
        if deed == 0:
            del group[key]
        elif deed == 1 and isinstance(group, dict):
            group[script.one([str(key) + "q", str(key).upper(), "xyzzy", "", 0])] = group[key]
        elif deed == 2:
            other, at = script.one(places)
            group[key] = other[at] if other is not group and at in _keys(other) else None
        elif deed == 3:
            group[key] = [group[key]] * 2
        else:
            group[key] = script.one(NASTY_VALUES)
    return data


def as_yaml(data: Any) -> bytes:
    """Return a tree as YAML; one that holds itself becomes an alias within what it names."""
    text: str = yaml.dump(data, Dumper=yaml.SafeDumper, sort_keys=False, allow_unicode=True)
    return text.encode("utf-8", "surrogatepass")


@functools.cache
def scratch() -> Path:
    """Return a folder that lives as long as this process."""
    folder = Path(tempfile.mkdtemp(prefix="tieline-fuzz-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _keys(group: Any) -> Any:
    return group if isinstance(group, dict) else range(len(group))


def _places(data: Any, depth: int = 0) -> Iterator[Place]:
    """Yield each place of a tree, not below what a deed may have tied into a circle."""
    if depth > 12 or not isinstance(data, dict | list):
        return
    for key in list(_keys(data)):
        yield data, key
        yield from _places(data[key], depth + 1)
