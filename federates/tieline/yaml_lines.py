"""Loads a YAML file safely and remembers on which line each of its values stands."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from tieline.errors import InputError
from tieline.resources import is_endless

Key = str | int | float | bool | None
Position = tuple[Key, ...]

MAX_VALUES = 200_000
"""Values that a document may hold with its aliases written out; a few nested aliases reach it."""

MAX_DEPTH = 100
"""Groups within groups that a document may hold. libyaml builds them by recursion without a limit
of its own, and a file of brackets would overflow its stack and kill the process."""

_MAX_BITS = 64
"""Python refuses to print integers of some thousand digits, which hexadecimal ones can have."""

_FAST = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_PLAIN_TAGS = ("tag:yaml.org,2002:map", "tag:yaml.org,2002:seq")


@dataclass(frozen=True)
class Document:
    """What a YAML file says, and where.

    Attributes:
        path: the file.
        data: its content as plain lists, dictionaries and scalars.
    """

    path: Path
    data: Any
    _lines: dict[Position, int] = field(repr=False, compare=False)

    def line(self, position: Position = ()) -> int:
        """Return the line (from 1) of the value at `position`, such as `("links", 3, "rate")`.

        The value of a key counts as standing where the key stands. A position that the file does
        not have gets the line of the nearest part around it that the file has.
        """
        while position and position not in self._lines:
            position = position[:-1]
        return self._lines.get(position, 1)

    def where(self, position: Position = ()) -> str:
        """Return `file:line` of the value at `position`, as findings begin with it."""
        return f"{self.path}:{self.line(position)}"


def load(path: Path) -> Document:
    """Return the one YAML document of a file; an empty file holds None.

    Raises:
        InputError: the file cannot be read or is no plain YAML: malformed, several documents, a
            key twice, a merge key, an unknown tag, an alias within itself, groups more than
            `MAX_DEPTH` deep, or nested aliases that write out to more than `MAX_VALUES` values.
    """
    if is_endless(path):
        raise InputError(f"{path}: cannot be read (it is a device or a pipe)")
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start})") from error
    try:
        return _parsed(path, text.removeprefix("\ufeff"))
    except yaml.MarkedYAMLError as error:
        raise InputError(f"{path}:{_mark_line(error)}: {_problem(error)}") from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise InputError(
            f"{path}:{line}: unacceptable character #x{int(error.character):04x}"
        ) from error


def _parsed(path: Path, text: str) -> Document:
    _check_depth(path, text)
    try:
        return _read_with(_FAST, path, text)
    except (yaml.YAMLError, InputError):
        # The parser in C, ten times as fast, words its complaints in another way.
        return _read_with(yaml.SafeLoader, path, text)


def _check_depth(path: Path, text: str) -> None:
    """Refuse a text that is nested too deeply; whatever else is wrong with it is left to others."""
    depth = 0
    loader = _FAST(text)
    try:
        while loader.check_event():
            event = loader.get_event()
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > MAX_DEPTH:
                line = event.start_mark.line + 1
                raise InputError(f"{path}:{line}: is nested more than {MAX_DEPTH} groups deep")
    except yaml.YAMLError:
        return
    finally:
        loader.dispose()


def _read_with(kind: Any, path: Path, text: str) -> Document:
    loader = kind(text)
    try:
        root = loader.get_single_node()
        reader = _Reader(path, loader)
        return Document(path, None if root is None else reader.value(root, ()), reader.lines)
    finally:
        loader.dispose()


class _Reader:
    """Walks the node tree once, building the data and noting the lines."""

    def __init__(self, path: Path, loader: yaml.SafeLoader) -> None:
        self.path = path
        self.loader = loader
        self.lines: dict[Position, int] = {}
        self.open_nodes: set[int] = set()

    def value(self, node: yaml.Node, position: Position) -> Any:
        self.lines.setdefault(position, node.start_mark.line + 1)
        if len(self.lines) > MAX_VALUES:
            raise self.refusal(node, f"holds more than {MAX_VALUES} values with its aliases")
        if isinstance(node, yaml.ScalarNode):
            return self.scalar(node)
        if node.tag not in _PLAIN_TAGS:
            raise self.refusal(node, f"could not determine a constructor for the tag '{node.tag}'")
        if id(node) in self.open_nodes:
            raise self.refusal(node, "an alias stands within what it names")
        self.open_nodes.add(id(node))
        content: Any
        if isinstance(node, yaml.MappingNode):
            content = self.mapping(node, position)
        else:
            content = [self.value(item, (*position, i)) for i, item in enumerate(node.value)]
        self.open_nodes.discard(id(node))
        return content

    def mapping(self, node: yaml.MappingNode, position: Position) -> dict[Key, Any]:
        content: dict[Key, Any] = {}
        for key_node, value_node in node.value:
            key = self.key(key_node)
            if key in content:
                first = self.lines[(*position, key)]
                raise self.refusal(key_node, f"key '{key}' stands twice (first on line {first})")
            self.lines[(*position, key)] = key_node.start_mark.line + 1
            content[key] = self.value(value_node, (*position, key))
        return content

    def key(self, node: yaml.Node) -> Key:
        if not isinstance(node, yaml.ScalarNode):
            raise self.refusal(node, "a key must be a single word or number")
        if node.tag == "tag:yaml.org,2002:merge":
            raise self.refusal(node, "merge keys (<<) are not supported; write the keys out")
        key: Key = self.scalar(node)
        return key

    def scalar(self, node: yaml.ScalarNode) -> Any:
        try:
            value = self.loader.construct_object(node)
        except ValueError as error:
            raise self.refusal(node, f"'{node.value:.60}' is malformed ({error})") from error
        if isinstance(value, int) and value.bit_length() > _MAX_BITS:
            raise self.refusal(
                node, f"'{node.value:.60}' is a whole number beyond {_MAX_BITS} bits"
            )
        return value

    def refusal(self, node: yaml.Node, reason: str) -> InputError:
        return InputError(f"{self.path}:{node.start_mark.line + 1}: {reason}")


def _mark_line(error: yaml.MarkedYAMLError) -> int:
    mark = error.problem_mark or error.context_mark
    return 1 if mark is None else mark.line + 1


def _problem(error: yaml.MarkedYAMLError) -> str:
    parts = [part for part in (error.context, error.problem) if part]
    return " ".join(parts) or "malformed YAML"
