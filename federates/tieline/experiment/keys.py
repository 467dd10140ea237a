"""The key of a broker: who may join a run, and how two sides prove to each other that they have it.

The key itself never crosses the network; HELICS's own key, which does so unencrypted, is derived
from it anew for each run. All comparisons take the same time whatever is wrong.
"""

import hashlib
import hmac
import os
import secrets
from collections.abc import Mapping, Sequence
from pathlib import Path

from tieline.errors import InputError
from tieline.experiment.supervise import Start, Started

KEY_VARIABLE = "TIELINE_BROKER_KEY"
HELICS_VARIABLE = "HELICS_BROKER_KEY"
"""HELICS reads the key of a broker or a core from here, so that no process list shows it."""

LEAST_LENGTH = 16
_RANDOM_BYTES = 24


def new_key() -> str:
    """Return a key that nobody can guess."""
    return secrets.token_urlsafe(_RANDOM_BYTES)


def given_key(path: Path | None) -> str | None:
    """Return the key in a file, or else in the environment; None where there is neither.

    Raises:
        InputError: the file cannot be read, others can read it too, or the key is too short.
    """
    key, origin = os.environ.get(KEY_VARIABLE), KEY_VARIABLE
    if path is not None:
        key, origin = _read(path), f"--key-file {path}"
    if key is None:
        return None
    if len(key) < LEAST_LENGTH:
        raise InputError(
            f"{origin} must hold a key of at least {LEAST_LENGTH} characters (got {len(key)})"
        )
    return key


def _read(path: Path) -> str:
    try:
        mode = path.stat().st_mode
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"--key-file {path} cannot be read: {error}") from error
    if mode & 0o077:
        raise InputError(
            f"--key-file {path} can be read by others (mode {mode & 0o777:o}): chmod 600 {path}"
        )
    return text.strip()


def proof(key: str, *words: str) -> str:
    """Return what only somebody with the key can say of some words."""
    # Lengths keep ("ab", "c") and ("a", "bc") apart.
    said = "".join(f"{len(word)}:{word}" for word in words)
    return hmac.new(key.encode(), said.encode(), hashlib.sha256).hexdigest()


def is_proof(given: object, key: str, *words: str) -> bool:
    """Return whether somebody has shown that they have the key."""
    wanted = proof(key, *words)
    return isinstance(given, str) and hmac.compare_digest(given.encode(), wanted.encode())


def keyed(start: Start, key: str | None) -> Start:
    """Return a way to start processes whose HELICS meets only who has the same key, if any."""
    if key is None:
        return start

    def start_with_key(command: Sequence[str], environment: Mapping[str, str]) -> Started:
        return start(command, {**environment, HELICS_VARIABLE: key})

    return start_with_key
