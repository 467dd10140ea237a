"""Reads a run file for the process that was started with it."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tieline.cosim.conventions import LOOPBACK, Place
from tieline.cosim.interfaces import FederationSettings
from tieline.errors import InputError


def read_run(argv: list[str]) -> tuple[dict[str, Any], Path]:
    """Return the run file's content and its folder.

    Raises:
        SystemExit: there is no such argument or file, or it is no JSON.
    """
    try:
        if len(argv) != 2:
            raise InputError(
                f"usage: {Path(argv[0]).name} RUN.json (got {len(argv) - 1} arguments)"
            )
        path = Path(argv[1])
        return json.loads(path.read_text(encoding="utf-8")), path.resolve().parent
    except (InputError, OSError, json.JSONDecodeError) as error:
        sys.stderr.write(f"cannot read the run file: {error}\n")
        raise SystemExit(InputError.exit_code) from error


def federation_of(run: Mapping[str, Any]) -> tuple[FederationSettings, Place]:
    """Return a run's federation settings, and where it meets."""
    stated = dict(run["federation"])
    port = stated.pop("broker_port", None)
    host = stated.pop("broker_host", LOOPBACK)
    interface = stated.pop("interface", LOOPBACK)
    settings = FederationSettings(**stated)
    return settings, Place(settings.core, port, host, interface)
