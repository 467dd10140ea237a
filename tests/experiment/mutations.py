"""Breaks experiments in ways that are always wrong, from a seed."""

import copy
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml

from tieline.problems import Path, value_at

WRONG_VALUES: tuple[Any, ...] = (
    {"nonsense": [None]},
    [[{"nonsense": 1}]],
    "5 parsec",
    -1e300,
    True,
    [],
    "",
)
"""None of them fits a number with a unit; only the first fits nothing at all."""


@dataclass(frozen=True)
class Mutant:
    """A broken experiment: what was done, where, and its text."""

    deed: str
    path: Path
    text: str


def mutants(data: dict[str, Any], generator: np.random.Generator) -> Iterator[Mutant]:
    """Yield mutants of an experiment without end, each with one mistake."""
    leaves = [path for path, value in walk(data) if not isinstance(value, dict | list)]
    keys = [path for path, _ in walk(data) if isinstance(path[-1], str)]
    deeds = (_misspelt, _of_no_kind, _no_quantity, _stranger)
    while True:
        deed = deeds[int(generator.integers(len(deeds)))]
        places = keys if deed in (_misspelt, _stranger) else leaves
        path = places[int(generator.integers(len(places)))]
        mutant = deed(copy.deepcopy(data), path, generator)
        if mutant is not None:
            yield mutant


def walk(data: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Yield every part of an experiment with its path."""
    members = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in members:
        yield (*path, key), value
        if isinstance(value, dict | list):
            yield from walk(value, (*path, key))


def _mutant(deed: str, path: Path, data: Any) -> Mutant:
    return Mutant(deed, path, yaml.safe_dump(data, sort_keys=False))


def _misspelt(data: Any, path: Path, generator: np.random.Generator) -> Mutant:
    """Two letters of a key change places, or one more comes in."""
    key = str(path[-1])
    at = int(generator.integers(1, len(key)))
    wrong = key[:at] + "q" + key[at:]
    group = value_at(data, path[:-1])
    members = [(wrong if name == path[-1] else name, value) for name, value in group.items()]
    group.clear()
    group.update(members)
    return _mutant("misspelt", (*path[:-1], wrong), data)


def _stranger(data: Any, path: Path, generator: np.random.Generator) -> Mutant:
    """A group has a key that no group knows."""
    value_at(data, path[:-1])["xyzzy"] = 1
    return _mutant("stranger", (*path[:-1], "xyzzy"), data)


def _of_no_kind(data: Any, path: Path, generator: np.random.Generator) -> Mutant:
    """A value is a group that stands nowhere."""
    value_at(data, path[:-1])[path[-1]] = {"nonsense": [None]}
    return _mutant("of no kind", path, data)


def _no_quantity(data: Any, path: Path, generator: np.random.Generator) -> Mutant | None:
    """A number, or a quantity, is something else."""
    value = value_at(data, path)
    is_quantity = isinstance(value, str) and value[:1].isdigit() and path[-1] != "label"
    if isinstance(value, bool) or not (isinstance(value, int | float) or is_quantity):
        return None
    wrong = WRONG_VALUES[int(generator.integers(len(WRONG_VALUES)))]
    value_at(data, path[:-1])[path[-1]] = wrong
    return _mutant(f"no quantity: {wrong!r}", path, data)
