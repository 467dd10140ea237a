"""Settings as Python writes them, turned into the `key=value` options of the command line."""

import re
from collections.abc import Iterator, Mapping
from pathlib import PurePath
from typing import Any

import yaml

from tieline.errors import InputError
from tieline.experiment.layers import REPLACED
from tieline.experiment.overrides import path_of

_OPTION = re.compile(r"^--set (?=\S)")


def options(*groups: Mapping[str, Any] | None) -> list[str]:
    """Return `key=value` options for settings, those of a later group after those of an earlier.

    Args:
        groups: settings by dotted key, `{"grid.pss.gain": 5}`, or nested,
            `{"grid": {"pss": {"gain": 5}}}`.

    Raises:
        InputError: a value that no YAML file could hold; every one at once.
    """
    stated, findings = [], []
    for key, value in (pair for group in groups if group for pair in _flat(group)):
        try:
            stated.append(f"{key}={_as_yaml(value)}")
        except yaml.YAMLError:
            findings.append(f"{key} must be a number, text, list or dictionary (got {value!r})")
    if findings:
        raise InputError(findings)
    return stated


def without_options(error: InputError) -> InputError:
    """Return an error that names settings by their keys, not as options of a command."""
    return InputError(_OPTION.sub("", finding) for finding in error.findings)


def _flat(group: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in group.items():
        path = f"{before}{key}"
        if isinstance(value, Mapping) and value and path_of(path) not in REPLACED:
            yield from _flat(value, f"{path}.")
        else:
            yield path, value


def _as_yaml(value: Any) -> str:
    text = yaml.safe_dump(_plain(value), default_flow_style=True, width=float("inf"))
    return text.removesuffix("...\n").strip()


def _plain(value: Any) -> Any:
    """Return numbers of numpy, tuples and paths as what YAML has for them."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value) if isinstance(value, PurePath) else value
