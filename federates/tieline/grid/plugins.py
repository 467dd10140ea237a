"""Models from outside the package: installed ones by entry point, and an experiment's own file.

An installed package offers a stabiliser by an entry point of the group `tieline.pss` whose name is
the model's key: `my_pss = "my_package.my_pss:MyPSS"`. A file holds one or more subclasses of
`Model`. This module stays light: what it names without loading needs no compiler.
"""

import hashlib
import importlib.util
import re
import sys
import traceback
from functools import cache
from importlib.metadata import EntryPoints, entry_points
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from tieline.errors import InputError

if TYPE_CHECKING:
    from tieline.grid.models.base import Model

FOLDERS = {"machine": "machines", "exciter": "exciters", "governor": "governors", "pss": "pss"}
_KEY = re.compile(r"[a-z][a-z0-9_]*")


def shipped_keys(role: str) -> list[str]:
    """Return the keys of the package's own models of a role: the names of their files."""
    folder = Path(__file__).parent / "models" / FOLDERS[role]
    return sorted(path.stem for path in folder.glob("[!_]*.py"))


def installed_keys(role: str) -> list[str]:
    """Return the keys of the models of a role that installed packages offer."""
    return sorted(point.name for point in _offered(role))


def installed_models(role: str) -> dict[str, "type[Model]"]:
    """Return the models of a role that installed packages offer, by key.

    Raises:
        InputError: one cannot be loaded, is no model, or has not the key of its entry point.
    """
    found = {}
    for point in _offered(role):
        where = f"entry point {point.name} = {point.value} of group tieline.{role}"
        try:
            loaded = point.load()
        except Exception as error:
            raise InputError(f"{where} cannot be loaded: {_last_line(error)}") from error
        found[point.name] = _require_model(loaded, role, where)
        if loaded.key != point.name:
            raise InputError(f"{where} must be named as its model, '{loaded.key}'")
    return found


def file_models(path: Path, role: str) -> dict[str, "type[Model]"]:
    """Return the models of a role that a Python file defines, by key.

    The file runs as a module whose name depends on its place alone, so that the compiler's cache
    beside the file serves the next process.

    Raises:
        InputError: there is no such file, it fails, or it defines no model of the role.
    """
    from tieline.grid.models.base import Model

    if not path.is_file():
        raise InputError(f"grid.{role}.file: no file {path}")
    module = _run(path.resolve(), f"grid.{role}.file: {path.name}")
    classes = [
        member
        for member in vars(module).values()
        if isinstance(member, type)
        and issubclass(member, Model)
        and member.__module__ == module.__name__
    ]
    where = f"grid.{role}.file: {path.name}"
    found = {
        model.key: model for model in (_require_model(member, role, where) for member in classes)
    }
    if not found:
        raise InputError(f"{where} defines no subclass of tieline.grid.models.base.Model")
    return found


def _offered(role: str) -> EntryPoints:
    return _entry_points(tuple(sys.path))[role]


@cache
def _entry_points(path: tuple[str, ...]) -> dict[str, EntryPoints]:
    """Return by role what the packages on the path offer: a file of each of them is read for it."""
    found = entry_points()
    return {role: found.select(group=f"tieline.{role}") for role in FOLDERS}


def _run(path: Path, where: str) -> ModuleType:
    place = hashlib.sha256(str(path).encode()).hexdigest()[:12]
    name = f"tieline_file_{place}_{path.stem}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise InputError(f"{where}:{_line(error, path)} {_last_line(error)}") from error
    return module


def _line(error: Exception, path: Path) -> str:
    """Return the line of the file that an error points at, with a colon, if it does."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"{error.lineno}:"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    return f"{frames[-1].lineno}:" if frames else ""


def _last_line(error: Exception) -> str:
    return traceback.format_exception_only(error)[-1].strip()


def _require_model(candidate: object, role: str, where: str) -> "type[Model]":
    """Return a model that declares itself whole, or say what it lacks.

    Raises:
        InputError: it is no model, lacks a declaration or names an unknown signal.
    """
    from tieline.grid.models.base import SIGNALS, Model

    if not (isinstance(candidate, type) and issubclass(candidate, Model)):
        raise InputError(f"{where} is no subclass of tieline.grid.models.base.Model")
    name = candidate.__name__
    needed = ("key", "role", "source", "parameters", "states", "equations")
    missing = [word for word in needed if not hasattr(candidate, word)]
    if missing:
        raise InputError(f"{where}: {name} does not declare {', '.join(missing)}")
    findings = []
    if candidate.role != role:
        findings.append(f"role must be '{role}' (got '{candidate.role}')")
    if not _KEY.fullmatch(candidate.key):
        findings.append(f"key must be lower case, digits and _ (got '{candidate.key}')")
    if candidate.key in shipped_keys(role):
        findings.append(f"key '{candidate.key}' is that of a shipped model")
    findings += [
        f"equations name no known signal '{signal}' (known: {', '.join(SIGNALS)})"
        for equation in candidate.equations
        for signal in (*equation.inputs, *equation.outputs)
        if signal not in SIGNALS
    ]
    if findings:
        raise InputError(f"{where}: {name}: {finding}" for finding in findings)
    return candidate
