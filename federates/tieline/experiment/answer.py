"""What a script is told of a result: one JSON object."""

from pathlib import Path
from typing import Any

from tieline.experiment.results import SUMMARY, read_json, read_manifest


def answer(folder: Path) -> dict[str, Any]:
    """Return `folder`, `kind` (run or sweep), `status`, `reason` and `summary` (null without one).

    Raises:
        InputError: the folder is no result.
    """
    manifest = read_manifest(folder)
    path = folder / SUMMARY
    return {
        "folder": str(folder),
        "kind": manifest["kind"],
        "status": manifest["status"],
        "reason": manifest["reason"],
        "summary": read_json(path) if path.is_file() else None,
    }
