"""How a federate that no launcher watches ended: a file beside its tables."""

import importlib.metadata
import json
import resource
from pathlib import Path
from typing import Any

import tieline
from tieline.cosim.status import Status
from tieline.errors import InputError


def word_path(folder: Path, federate: str) -> Path:
    """Return where a federate leaves its word."""
    return folder / f"{federate}.ended.json"


def leave_word(folder: Path, status: Status, code: int) -> None:
    """Write down how a federate ended: its last status, code, memory and versions."""
    word = status.line() | {
        "exit_code": code,
        "wall_s": round(status.wall_s, 3),
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "tieline": tieline.__version__,
        "helics": importlib.metadata.version("helics"),
    }
    path = word_path(folder, status.federate)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(word, indent=2) + "\n", encoding="utf-8")
    part.replace(path)


def read_word(folder: Path, federate: str) -> dict[str, Any] | None:
    """Return a federate's word, or None if it left none.

    Raises:
        InputError: the file is no JSON.
    """
    path = word_path(folder, federate)
    if not path.is_file():
        return None
    try:
        word: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return word
    except ValueError as error:
        raise InputError(f"{path}: is no JSON ({error})") from error
