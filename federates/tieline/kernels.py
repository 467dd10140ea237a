"""Keeps compiled functions on disk, each under everything that its compiled code depends on.

numba's own cache renews a function when its own file changes, and not when a constant or a function
that it took from another file does. Here a file's name is a hash of the function's code, of the
code and constants of all that it calls, of the types that it was compiled for (with the names of
their fields), of what changes numba's compiler here, and of processor, numba, llvmlite and Python.
So a file is never wrong and never renewed: what another state of the source needs has another name,
and an edit of anything else compiles nothing.
"""

import hashlib
import os
import pickle
import sys
import tempfile
import uuid
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import config, types
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.core.types.containers import BaseNamedTuple

from tieline.fingerprint import fingerprint
from tieline.kernel_lock import Lock

SUFFIX = ".nbc"

MOST_VERSIONS = 16
"""Files of one function that stay, the newest: those of other types, processors and sources."""

SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")
"""What numba's environment variables change about code."""

MAKERS = ("by_address.py", "compiler_thrift.py", "indices.py", "prefetch.py", "whole_program.py")
"""Files beside this one that change what numba makes of a function."""


class Kernels:
    """The files of one function, in the place of numba's own cache.

    Args:
        function: as it is written.
        options: what it is compiled with.
    """

    def __init__(self, function: Callable[..., Any], options: object) -> None:
        self._function = function
        self._options = options
        self._locks: dict[str, Lock] = {}

    @property
    def cache_path(self) -> str:
        """Return the folder of the files, as numba asks for it."""
        return str(folder() or "")

    def load_overload(self, signature: Any, target_context: Any) -> CompileResult | None:
        """Return the function compiled for a signature, or None if no file has it.

        While another process compiles it, this one waits, and takes what that has made.
        """
        target_context.refresh()
        name = self._name(signature, target_context.codegen())
        content = _read(name)
        if content is None and (target := folder()) is not None:
            lock = Lock(target / f"{name}.lock")
            if lock.acquire((target / name).exists):
                self._locks[name] = lock
            content = _read(name)
            if content is not None:
                self._release(name)
        return None if content is None else CompileResult._rebuild(target_context, *content)

    def save_overload(self, signature: Any, result: CompileResult) -> None:
        """Write the function compiled for a signature; where that fails, it is compiled again."""
        name = self._name(signature, result.codegen)
        target = folder()
        try:
            if target is not None and not result.library.has_dynamic_globals:
                _write(target / name, dumps(result._reduce()))
                _forget(target, self._stem)
        finally:
            self._release(name)

    def enable(self) -> None:
        """Do nothing: numba may switch its own cache off, this one stays on."""

    disable = flush = enable

    @property
    def _stem(self) -> str:
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        return name.replace("<", "").replace(">", "")

    def _name(self, signature: Any, codegen: Any) -> str:
        parts = (fingerprint(self._function), str(self._options), _made_by(), _told(signature))
        key = "\n".join((*parts, *map(str, codegen.magic_tuple())))
        return f"{self._stem}-{hashlib.sha256(key.encode()).hexdigest()[:24]}{SUFFIX}"

    def _release(self, name: str) -> None:
        if name in self._locks:
            self._locks.pop(name).release()


@cache
def _made_by() -> str:
    texts = b"".join(Path(__file__).with_name(name).read_bytes() for name in MAKERS)
    return hashlib.sha256(texts).hexdigest()


def _told(signature: Any) -> str:
    """Return the types of a signature, with the names of the fields of each tuple that has them."""
    if isinstance(signature, numba.core.typing.Signature):
        return f"{_told(signature.args)}->{_told(signature.return_type)}"
    if isinstance(signature, tuple):
        return f"({','.join(map(_told, signature))})"
    if isinstance(signature, BaseNamedTuple):
        inside = ",".join(map(_told, signature))
        return f"{signature.instance_class.__qualname__}{signature.fields}({inside})"
    if isinstance(signature, types.Dispatcher):
        return fingerprint(signature.dispatcher.py_func)
    return str(signature)


@cache
def home() -> Path:
    """Return where compiled code belongs; NUMBA_CACHE_DIR and XDG_CACHE_HOME may say so."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen)
    text = f"{numba.__version__} {llvmlite.__version__} {sys.implementation.cache_tag}"
    text += "".join(f" {getattr(config, name)}" for name in SETTINGS)
    place = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(place) / "tieline" / hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
def folder() -> Path | None:
    """Return the folder that takes what is compiled, made if missing; None where there is none.

    That is `home`, or, where that cannot be written, one in the system's temporary folder that
    nobody else can write; what `home` holds is read all the same.
    """
    with suppress(OSError):
        home().mkdir(parents=True, exist_ok=True)
        if os.access(home(), os.W_OK):
            return home()
    spare = Path(tempfile.gettempdir()) / f"tieline-{os.getuid()}-{home().name}"
    with suppress(OSError):
        spare.mkdir(mode=0o700, exist_ok=True)
        state = spare.lstat()
        if state.st_uid == os.getuid() and not state.st_mode & 0o022 and not spare.is_symlink():
            return spare
    return None


def count() -> int:
    """Return how many compiled functions there are for this process to load."""
    return len({path.name for place in _places() for path in place.glob(f"*{SUFFIX}")})


def _places() -> Iterator[Path]:
    yield home()
    other = folder()
    if other is not None and other != home():
        yield other


def _read(name: str) -> tuple[Any, ...] | None:
    for place in _places():
        try:
            content: tuple[Any, ...] = pickle.loads((place / name).read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            continue
        return content
    return None


def _write(path: Path, content: bytes) -> None:
    """Write a file that appears whole or not at all."""
    _tell_of_spare(path.parent)
    part = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        warnings.warn(
            f"compiled code cannot be kept ({error}): it is compiled anew each time",
            RuntimeWarning,
            stacklevel=2,
        )


@cache
def _tell_of_spare(target: Path) -> None:
    if target != home():
        warnings.warn(
            f"{home()} cannot be written: compiled code is kept in {target}; XDG_CACHE_HOME may"
            " name a lasting place",
            RuntimeWarning,
            stacklevel=2,
        )


def _forget(target: Path, stem: str) -> None:
    """Remove the oldest files of a function beyond those that stay."""
    with suppress(OSError):
        found = sorted(target.glob(f"{stem}-*{SUFFIX}"), key=lambda path: -path.stat().st_mtime)
        for old in found[MOST_VERSIONS:]:
            old.unlink(missing_ok=True)
