"""The files that an experiment is made of: its own, and those that `extends:` leads to."""

import copy
import os
import pathlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tieline import yaml_lines
from tieline.errors import InputError
from tieline.problems import Path, near, value_at
from tieline.resources import is_file, shipped
from tieline.yaml_lines import Document

EXTENDS = "extends"

REPLACED: tuple[Path, ...] = (
    ("sweep",),
    ("network", "queue"),
    ("network", "jitter"),
    ("network", "empirical"),
)
"""Groups that are one thing: a file that states one replaces it, key by key would mix two kinds."""

OWN: Path = ("name",)
"""What a file never takes from another: a second experiment of one name would be mistaken."""

_FILES: tuple[Path, ...] = (
    ("case",),
    ("grid", "pss", "file"),
    ("network", "topology"),
    ("network", "jitter", "file"),
    ("network", "empirical", "trace"),
    ("network", "empirical", "distribution", "file"),
)
"""Settings that may name a file, which then counts from the file that says so."""


@dataclass(frozen=True)
class Layers:
    """An experiment's files.

    Attributes:
        documents: its own file, the file that this one extends, and so on.
        data: all of them together, without `extends`.
    """

    documents: tuple[Document, ...]
    data: Any

    @property
    def document(self) -> Document:
        """Return the experiment's own file."""
        return self.documents[0]

    def place(self, paths: Sequence[Path]) -> tuple[Document, int]:
        """Return file and line where the settings at some paths are given; the first that is."""
        places = [(path, self._owner(path)) for path in paths]
        stated = [pair for pair in places if value_at(pair[1].data, pair[0]) is not None]
        path, document = [*stated, *places][0]
        return document, document.line(path)

    def _owner(self, path: Path) -> Document:
        """Return the file that gives what stands at a path, or the nearest part around it."""
        holders = list(self.documents[:1] if path[:1] == OWN else self.documents)
        for depth in range(1, len(path) + 1):
            before = path[:depth]
            having = [d for d in holders if _has(d.data, before)]
            if not having:
                break
            is_group = isinstance(value_at(having[0].data, before), dict)
            holders = having if is_group and before not in REPLACED else having[:1]
        return holders[0]


def read_layers(path: pathlib.Path) -> Layers:
    """Return an experiment's file with all that it extends.

    Raises:
        InputError: a file cannot be read, `extends` names none, or leads back to itself.
    """
    documents = [yaml_lines.load(path)]
    seen = [path.resolve()]
    while (base := _base_of(documents[-1])) is not None:
        if base.resolve() in seen:
            chain = " -> ".join(p.name for p in [*seen, base])
            raise InputError(f"{_where(documents[-1])}: extends leads back to itself ({chain})")
        documents.append(yaml_lines.load(pathlib.Path(shortest(base))))
        seen.append(base.resolve())
        if not isinstance(documents[-1].data, dict):
            raise InputError(
                f"{_where(documents[-2])}: extends {shortest(base)}, which is no group of keys"
            )
    return Layers(tuple(documents), _merged(documents))


def find_experiment(reference: str) -> pathlib.Path:
    """Return the file of an experiment given by its path or by a shipped name.

    Raises:
        InputError: there is no such file; the message lists the shipped experiments.
    """
    path = pathlib.Path(reference)
    if is_file(path):
        return path
    by_name = _shipped_file(reference)
    if by_name is not None:
        return by_name
    raise InputError(f"no experiment {_unfound(reference)}")


def shipped_experiments() -> list[pathlib.Path]:
    """Return the files of the shipped experiments, in order of their names."""
    return sorted(shipped("configs").glob("*.yaml"))


def shortest(path: pathlib.Path) -> str:
    """Return a path relative to the working folder where it lies within it."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else relative


def _base_of(document: Document) -> pathlib.Path | None:
    """Return the file that a document extends, if any.

    Raises:
        InputError: there is no such file.
    """
    data = document.data
    name = data.get(EXTENDS) if isinstance(data, dict) else None
    if name is None:
        return None
    if not isinstance(name, str) or not name:
        raise InputError(
            f"{_where(document)}: extends must be a file or a shipped name (got {name!r:.60})"
        )
    beside = document.path.parent / name
    for path in (beside, pathlib.Path(f"{beside}.yaml"), _shipped_file(name)):
        if path is not None and is_file(path):
            return path
    raise InputError(f"{_where(document)}: extends no experiment {_unfound(name)}")


def _where(document: Document) -> str:
    return f"{shortest(document.path)}:{document.line((EXTENDS,))}"


def _shipped_file(name: str) -> pathlib.Path | None:
    path = shipped("configs") / f"{name}.yaml"
    return path if re.fullmatch(r"[\w-]+", name) and is_file(path) else None


def _unfound(reference: str) -> str:
    names = [path.stem for path in shipped_experiments()]
    return (
        f"'{reference}'{near(reference, names)} (shipped: {', '.join(names)};"
        " or give the path of a YAML file)"
    )


def _merged(documents: Sequence[Document]) -> Any:
    if len(documents) == 1 and not isinstance(documents[0].data, dict):
        return {} if documents[0].data is None else documents[0].data
    merged: dict[Any, Any] = {}
    own = documents[0].path.parent.resolve()
    for document in reversed(documents):
        data = {key: value for key, value in document.data.items() if key != EXTENDS}
        if document is not documents[0]:
            data.pop(OWN[0], None)
            if document.path.parent.resolve() != own:
                data = _with_own_files(data, document.path.parent.resolve())
        merged = _over(merged, data, ())
    return merged


def _over(base: Any, upper: Any, path: Path) -> Any:
    """Return a group with another put over it, key by key; anything else replaces."""
    if not (isinstance(base, dict) and isinstance(upper, dict)) or path in REPLACED:
        return copy.deepcopy(upper)
    both = dict(base)
    for key, value in upper.items():
        both[key] = _over(base.get(key), value, (*path, key))
    return both


def _with_own_files(data: dict[Any, Any], folder: pathlib.Path) -> dict[Any, Any]:
    """Return settings in which names of files that lie beside their file are absolute paths."""
    changed = copy.deepcopy(data)
    for path in _FILES:
        _make_absolute(value_at(changed, path[:-1]) if path[:-1] else changed, [path[-1]], folder)
    points = changed.get("sweep")
    keys = [".".join(map(str, path)) for path in _FILES]
    for point in points if isinstance(points, list) else []:
        _make_absolute(point, keys, folder)
    if isinstance(points, dict):
        _make_absolute(points.get("over"), keys, folder)
    return changed


def _make_absolute(group: Any, keys: Iterable[str | int], folder: pathlib.Path) -> None:
    for key in keys if isinstance(group, dict) else ():
        if key in group:
            group[key] = _absolute(group[key], folder)


def _absolute(name: Any, folder: pathlib.Path) -> Any:
    """Return a name, or each of several to choose from, as a path if it is one in the folder."""
    if isinstance(name, list):
        return [_absolute(each, folder) for each in name]
    if isinstance(name, dict) and isinstance(name.get("choice"), list):
        return name | {"choice": _absolute(name["choice"], folder)}
    is_there = isinstance(name, str) and any(
        is_file(path) for path in (folder / name, folder / name / "case.yaml")
    )
    return str(folder / name) if is_there else name


def _has(data: Any, path: Path) -> bool:
    for part in path:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return False
    return True
