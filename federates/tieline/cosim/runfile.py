"""Reads a run file for the process that was started with it."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.cosim.conventions import LOOPBACK, Place
from tieline.cosim.interfaces import FederationSettings
from tieline.errors import InputError

HELICS_OPTION = "--helics"
"""What a federate's HELICS file follows, in the place of the configuration of the run."""


def read_run(argv: list[str]) -> tuple[dict[str, Any], Path]:
    """Return the run file's content and its folder.

    Raises:
        SystemExit: there is no such argument or file, or it is no JSON.
    """
    try:
        if len(argv) not in (2, 4) or argv[2:3] not in ([], [HELICS_OPTION]):
            raise InputError(
                f"usage: {Path(argv[0]).name} RUN.json [{HELICS_OPTION} FEDERATE.json]"
                f" (got {' '.join(argv[1:]) or 'nothing'})"
            )
        path = Path(argv[1])
        return json.loads(path.read_text(encoding="utf-8")), path.resolve().parent
    except (InputError, OSError, json.JSONDecodeError) as error:
        raise _unreadable(error) from error


def read_config(argv: list[str]) -> dict[str, Any] | None:
    """Return the federate's own HELICS file, where the arguments name one.

    Raises:
        SystemExit: there is no such file, or it is no JSON.
    """
    if len(argv) < 4:
        return None
    try:
        config: dict[str, Any] = json.loads(Path(argv[3]).read_text(encoding="utf-8"))
        return config
    except (OSError, json.JSONDecodeError) as error:
        raise _unreadable(error) from error


def _unreadable(error: Exception) -> SystemExit:
    sys.stderr.write(f"cannot read the run file: {error}\n")
    return SystemExit(InputError.exit_code)


def federation_of(run: Mapping[str, Any]) -> tuple[FederationSettings, Place]:
    """Return a run's federation settings, and where it meets."""
    stated = dict(run["federation"])
    port = stated.pop("broker_port", None)
    host = stated.pop("broker_host", LOOPBACK)
    interface = stated.pop("interface", LOOPBACK)
    settings = FederationSettings(**stated)
    return settings, Place(settings.core, port, host, interface)
