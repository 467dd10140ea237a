"""Finds every device model: a file in the folder of its role is all that a model needs."""

import importlib
import inspect
import pkgutil
from functools import cache
from pathlib import Path

from tieline.grid.models.base import ROLES, Model
from tieline.grid.plugins import FOLDERS, file_models, installed_models

_FROM_FILE: dict[str, dict[str, type[Model]]] = {}


def models(role: str) -> dict[str, type[Model]]:
    """Return the models of a role (one of `ROLES`) by the name that tables use.

    These are the package's own, those of installed packages and those of the file in use.

    Raises:
        InputError: an installed package offers something that is no model.
    """
    assert role in ROLES
    return {**_shipped(role), **_installed(role), **_FROM_FILE.get(role, {})}


def use_file(role: str, path: Path | str | None) -> None:
    """Let the models of a Python file be found, in place of those of an earlier one.

    Args:
        role: one of `ROLES`.
        path: the file; None takes the earlier one out.

    Raises:
        InputError: the file cannot be used; see `plugins.file_models`.
    """
    _FROM_FILE[role] = {} if path is None else file_models(Path(path), role)


def load_shipped() -> None:
    """Import every model of the package, so that forks of this process need not."""
    for role in ROLES:
        _shipped(role)


@cache
def _shipped(role: str) -> dict[str, type[Model]]:
    package = importlib.import_module(f"tieline.grid.models.{FOLDERS[role]}")
    found: dict[str, type[Model]] = {}
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda item: item.name):
        name = f"{package.__name__}.{module.name}"
        for _, member in inspect.getmembers(importlib.import_module(name), inspect.isclass):
            if issubclass(member, Model) and member.__module__ == name:
                found[member.key] = member
    return found


@cache
def _installed(role: str) -> dict[str, type[Model]]:
    return installed_models(role)
