"""Finds every device model: a file in the folder of its role is all that a model needs."""

import importlib
import inspect
import pkgutil
from functools import cache

from tieline.grid.models.base import ROLES, Model

_FOLDERS = {"machine": "machines", "exciter": "exciters", "governor": "governors", "pss": "pss"}


@cache
def models(role: str) -> dict[str, type[Model]]:
    """Return the models of a role (one of `ROLES`) by the name that tables use."""
    assert role in ROLES
    package = importlib.import_module(f"tieline.grid.models.{_FOLDERS[role]}")
    found: dict[str, type[Model]] = {}
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda item: item.name):
        name = f"{package.__name__}.{module.name}"
        for _, member in inspect.getmembers(importlib.import_module(name), inspect.isclass):
            if issubclass(member, Model) and member.__module__ == name:
                found[member.key] = member
    return found
