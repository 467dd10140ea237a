"""Tells states of a function apart: by its code and by everything that the code refers to."""

import builtins
import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

_KNOWN: dict[Callable[..., Any], str] = {}
_FOREIGN = ("numpy", "math", "cmath", "numba", "scipy", "builtins")
"""Packages that stand for themselves: their versions are told elsewhere."""


def fingerprint(function: Callable[..., Any]) -> str:
    """Return a hash of a function's code and of the values and functions that it refers to.

    Two states of a source with one hash compile to the same code. Places in files do not count,
    nor do comments and docstrings of modules; a value of a kind that has no lasting text is told by
    its pickled form.
    """
    return _fingerprint(function, _Walk())


@dataclass
class _Walk:
    """The way from a function down to what it calls.

    Attributes:
        callers: those above, the first one first.
        is_cyclic: whether one was met that calls itself; what is found then holds for this way.
    """

    callers: list[Callable[..., Any]] = field(default_factory=list)
    is_cyclic: bool = False


def _fingerprint(function: Callable[..., Any], walk: _Walk) -> str:
    if function in _KNOWN:
        return _KNOWN[function]
    if function in walk.callers:
        walk.is_cyclic = True
        return f"recursion {walk.callers[::-1].index(function)}"
    assert isinstance(function, FunctionType)
    digest = hashlib.sha256(f"{function.__module__}.{function.__qualname__}".encode())
    walk.callers.append(function)
    for text in _parts(function, walk):
        digest.update(text.encode() + b"\n")
    walk.callers.pop()
    result = digest.hexdigest()
    if not walk.is_cyclic:
        _KNOWN[function] = result
    return result


def _parts(function: FunctionType, walk: _Walk) -> Iterator[str]:
    yield from _code(function.__code__)
    names = set(_names(function.__code__))
    yield _text(function.__defaults__, names, walk)
    for cell in function.__closure__ or ():
        yield _text(cell.cell_contents, names, walk)
    for name in sorted(names):
        if name in function.__globals__:
            yield f"{name}={_text(function.__globals__[name], names, walk)}"


def _code(code: CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield str((code.co_argcount, code.co_names, code.co_varnames, code.co_freevars))
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant)
        elif isinstance(constant, frozenset):
            yield str(sorted(map(repr, constant)))
        else:
            yield repr(constant)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _text(value: Any, names: set[str], walk: _Walk) -> str:
    """Return what tells a value from others; of a module, what is taken from it."""
    if hasattr(value, "py_func"):
        options = getattr(value, "targetoptions", None)
        return f"{options}{_fingerprint(value.py_func, walk)}"
    if isinstance(value, FunctionType):
        is_foreign = value.__module__.partition(".")[0] in _FOREIGN
        return value.__qualname__ if is_foreign else _fingerprint(value, walk)
    if isinstance(value, ModuleType):
        if value.__name__.partition(".")[0] in _FOREIGN:
            return value.__name__
        taken = {name: getattr(value, name) for name in sorted(names) if hasattr(value, name)}
        return _text(taken, names, walk)
    if isinstance(value, np.ndarray):
        return f"{value.dtype.descr}{value.shape}{value.tobytes().hex()}"
    if isinstance(value, Mapping):
        return str([(key, _text(item, names, walk)) for key, item in value.items()])
    if isinstance(value, tuple | list):
        items = [_text(item, names, walk) for item in value]
        return f"{type(value).__name__}{getattr(value, '_fields', '')}{items}"
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__}{getattr(value, '_fields', '')}"
    if value is None or isinstance(value, int | float | complex | str | bytes | np.generic):
        return f"{type(value).__name__} {value!r}"
    if type(value).__module__.partition(".")[0] == "numba":
        return str(value)
    return _named(value)


def _named(value: Any) -> str:
    name = getattr(value, "__qualname__", getattr(value, "__name__", None))
    if name is not None and (hasattr(builtins, name) or hasattr(value, "__module__")):
        return f"{value.__module__}.{name}"
    from numba.core.serialize import dumps

    return f"{type(value).__qualname__} {hashlib.sha256(dumps(value)).hexdigest()}"
