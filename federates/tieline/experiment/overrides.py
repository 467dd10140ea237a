"""Single settings put over an experiment: `--set key=value`, and the keys of a sweep point."""

import copy
import pathlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from tieline.experiment.layers import Layers, shortest
from tieline.problems import Path
from tieline.yaml_lines import Document


@dataclass(frozen=True)
class Override:
    """One setting: `where` says in messages where it was given.

    Attributes:
        path: the setting.
        value: what it is.
        where: the option, or file and line.
        at: where the files hold its value, or nothing for an option.
    """

    path: Path
    value: Any
    where: str
    at: Path = ()


def parse_settings(settings: Iterable[str]) -> tuple[list[Override], list[str]]:
    """Return the overrides that `--set key=value` options ask for, and what is wrong with others.

    Values are YAML, as in the file.
    """
    overrides, findings = [], []
    for text in settings:
        where = f"--set {text}"
        key, equals, value = text.partition("=")
        if not equals or not all(key.split(".")):
            findings.append(f"{where}: must be key=value, such as network.mean_delay=250ms")
            continue
        try:
            overrides.append(Override(path_of(key), yaml.safe_load(value), where))
        except (yaml.YAMLError, ValueError, RecursionError):
            findings.append(f"{where}: the value {value!r} is no YAML; quote it")
    return overrides, findings


def path_of(key: str) -> Path:
    """Return the path that a dotted key names; whole numbers are places in a list."""
    return tuple(int(part) if part.isdecimal() else part for part in key.split("."))


def related(one: Path, other: Path) -> bool:
    """Return whether one path leads to the other."""
    shorter = min(len(one), len(other))
    return one[:shorter] == other[:shorter]


def apply(data: Any, overrides: Iterable[Override]) -> tuple[Any, list[str]]:
    """Return a copy of the data with the overrides in place, and what could not be placed.

    Missing groups are made. An override cannot lead into a single value or past a list's end.
    """
    changed = copy.deepcopy(data)
    reasons = [(override, _put(changed, override.path, override.value)) for override in overrides]
    return changed, [f"{override.where}: {reason}" for override, reason in reasons if reason]


def _put(data: Any, path: Path, value: Any) -> str:
    """Put a value in place; the answer says why that is impossible, or nothing."""
    for i, part in enumerate(path):
        reason = _no_way(data, part, ".".join(map(str, path[:i])))
        if reason:
            return reason
        if i == len(path) - 1:
            data[part] = value
        elif isinstance(data, dict) and data.get(part) is None:
            data[part] = {}
        data = data[part]
    return ""


def _no_way(data: Any, part: str | int, before: str) -> str:
    if isinstance(data, list):
        if isinstance(part, int) and part < len(data):
            return ""
        return f"'{before}' is a list of {len(data)}: give a place from 0 to {len(data) - 1}"
    if isinstance(data, dict):
        return ""
    return f"'{before}' is a single value: it has no '{part}'"


@dataclass(frozen=True)
class Sources:
    """Where an experiment's settings come from: its files, and the options put over them."""

    layers: Layers
    options: tuple[Override, ...] = ()

    @property
    def document(self) -> Document:
        """Return the experiment's own file."""
        return self.layers.document

    @property
    def folder(self) -> pathlib.Path:
        """Return the folder from which names of files count."""
        return self.document.path.parent.resolve()

    def where(self, paths: Iterable[Path], overrides: Iterable[Override] = ()) -> str:
        """Return the place to look at first for the settings at some paths.

        An option or override that gives one of them goes before the files, what a file gives
        before what all leave out, and the experiment's own file before those that it extends.
        """
        paths = list(paths)
        given = [*self.options, *overrides]
        for path in paths:
            for override in given:
                if related(override.path, path):
                    inside = path[len(override.path) :]
                    return self._line([(*override.at, *inside)]) if override.at else override.where
        return self._line(paths)

    def _line(self, paths: Sequence[Path]) -> str:
        document, line = self.layers.place(paths)
        return f"{shortest(document.path)}:{line}"
