"""The base of everything that a topology file may say."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, TypeAdapter, ValidationInfo
from pydantic_core.core_schema import CoreSchema

from tieline.resources import is_endless


class Entry(BaseModel):
    """Refuses keys that it does not know."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


@dataclass(frozen=True)
class InTheWordsOf:
    """Describes entries that are read later in JSON Schema: those of some models.

    Attributes:
        models: what an entry may be.
    """

    models: tuple[type[Entry], ...]

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return the schema of any one of the models."""
        choices = [handler(TypeAdapter(model).core_schema) for model in self.models]
        return choices[0] if len(choices) == 1 else {"oneOf": choices}


def named_file(value: Any, info: ValidationInfo) -> Path:
    """Return the path of a file that an entry names, relative to the topology file.

    Raises:
        ValueError: the name is no text, or leads to a device or a pipe.
    """
    if not isinstance(value, str):
        raise ValueError(f"must be the path of a file (got {value!r})")
    folder: Path = (info.context or {}).get("folder", Path())
    path = folder / value
    if is_endless(path):
        raise ValueError(f"cannot read {path}: it is a device or a pipe")
    return path
