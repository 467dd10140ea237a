"""Writes down which random streams an engine has, and how many numbers of each were used."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tieline.network.engine import StreamUse

STREAMS = "streams.json"


def write_streams(path: Path, uses: Sequence[StreamUse]) -> None:
    """Write the streams of an engine to a file that appears whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    part.write_text(json.dumps(listed(uses), indent=1) + "\n", encoding="utf-8")
    part.replace(path)


def listed(uses: Sequence[StreamUse]) -> list[dict[str, Any]]:
    """Return streams by what their numbers are, each name with how many have been used.

    `taken` is None where nobody counts them.
    """
    families: dict[tuple[str, bool], dict[str, int | None]] = {}
    for use in uses:
        families.setdefault((use.gives, use.is_seeded), {})[use.name] = use.taken
    return [
        {"gives": gives, "is_seeded": is_seeded, "taken": taken}
        for (gives, is_seeded), taken in families.items()
    ]
