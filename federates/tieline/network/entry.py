"""The base of everything that a topology file may say."""

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationInfo


class Entry(BaseModel):
    """Refuses keys that it does not know."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


def named_file(value: Any, info: ValidationInfo) -> Path:
    """Return the path of a file that an entry names, relative to the topology file.

    Raises:
        ValueError: the name is no text.
    """
    if not isinstance(value, str):
        raise ValueError(f"must be the path of a file (got {value!r})")
    folder: Path = (info.context or {}).get("folder", Path())
    return folder / value
