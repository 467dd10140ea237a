"""The JSON Schema of an experiment file, made from the same declarations that check it."""

import json
from collections.abc import Iterator
from typing import Any

from tieline.experiment.layers import EXTENDS
from tieline.experiment.sampling import SweepBlock
from tieline.experiment.schema import FIXED, Experiment

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"
FILE_NAME = "experiment.schema.json"
"""The schema's file beside the shipped experiments, whose first lines name it for editors."""

_BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
_REF = "#/$defs/"


def json_schema() -> Schema:
    """Return the schema of an experiment file, JSON Schema draft 2020-12.

    Numbers carry `unit`, an annotation that validators pass over. What only holds between settings
    is not said: `tieline validate` checks that.
    """
    tidy = _Tidy()
    experiment = tidy.model(Experiment.model_json_schema())
    block = tidy.model(SweepBlock.model_json_schema())
    defs: Schema = {**tidy.definitions}
    keys = dict(_settings(experiment, defs))
    defs["SweepAxis"] = _axis(block)
    defs["SweepBlock"] = _block(block, keys)
    defs["SweepPoint"] = _point(keys)
    return {
        "$schema": DIALECT,
        "title": "tieline experiment",
        "description": "An experiment of tieline: grid, measurements, network, and what is swept.",
        "type": "object",
        "additionalProperties": False,
        "properties": _of_the_file(experiment["properties"]),
        "required": ["name"],
        "anyOf": [{"required": ["question"]}, {"required": [EXTENDS]}],
        "$defs": dict(sorted(defs.items())),
    }


def _of_the_file(settings: Schema) -> Schema:
    """Return an experiment's settings with the two keys that a file has besides."""
    extends = {
        "description": (
            "another experiment, by its file or shipped name, whose settings hold where this file "
            "is silent"
        ),
        "type": "string",
        "minLength": 1,
    }
    sweep = {
        "description": "many runs of one experiment: a list of points, or a block",
        "default": None,
        "anyOf": [
            {"type": "array", "items": {"$ref": f"{_REF}SweepPoint"}},
            {"$ref": f"{_REF}SweepBlock"},
            {"type": "null"},
        ],
    }
    first = {name: settings[name] for name in ("name", "question")}
    return {**first, EXTENDS: extends, **settings, "sweep": sweep}


def as_text(schema: Schema) -> str:
    """Return a schema as the text of its file."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def editor_line(schema: str) -> str:
    """Return the comment by which editors find an experiment's schema, by its path or URL."""
    return f"# yaml-language-server: $schema={schema}"


def target(schema: Schema, definitions: Schema) -> Schema:
    """Return what a reference stands for, or the schema itself."""
    name = schema.get("$ref", "")
    return definitions[name.removeprefix(_REF)] if name else schema


def is_group(schema: Schema, definitions: Schema) -> bool:
    """Return whether a schema is one group of named settings."""
    return "$ref" in schema and "properties" in target(schema, definitions)


def _settings(group: Schema, defs: Schema, prefix: str = "", at: str = "#/") -> Iterator[Any]:
    """Yield (dotted key, schema) of every setting that a sweep may change."""
    for name, own in group["properties"].items():
        if not prefix and name in FIXED:
            continue
        place = f"{at}properties/{name}"
        if is_group(own, defs):
            inner = own["$ref"]
            yield from _settings(target(own, defs), defs, f"{prefix}{name}.", f"{inner}/")
        else:
            yield f"{prefix}{name}", {"$ref": place, "description": own["description"], "is": own}


def _point(keys: Schema) -> Schema:
    """Return the schema of one point of a listed sweep."""
    return {
        "description": "One run: its label, and the settings that are its own.",
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "label": {
                "description": "what the point is called in tables, plots and folders",
                "type": ["string", "number"],
            },
            **{key: {"$ref": found["$ref"]} for key, found in keys.items()},
        },
        "patternProperties": dict.fromkeys(_deeper(keys), True),
        "required": ["label"],
    }


def _axis(block: Schema) -> Schema:
    """Return what a setting may be given in a sweep block: one of the axes."""
    axis: Schema = block["properties"]["over"]["additionalProperties"]
    return {
        "description": "Values in a list, or one of the distributions and spacings.",
        "anyOf": [{"type": "array", "minItems": 1}, *axis["oneOf"]],
    }


def _block(block: Schema, keys: Schema) -> Schema:
    """Return the schema of a sweep block, with every setting that it can be over."""
    axis = {"$ref": f"{_REF}SweepAxis"}
    own = block["properties"]["over"]
    own["properties"] = {
        key: {"description": found["description"], **axis} for key, found in keys.items()
    }
    own["patternProperties"] = dict.fromkeys(_deeper(keys), axis)
    own["additionalProperties"] = False
    return block


def _deeper(keys: Schema) -> list[str]:
    """Return patterns of the dotted keys that lead into lists and into entries of their own."""
    return [
        f"^{key.replace('.', '[.]')}[.].+$"
        for key, found in keys.items()
        if _has_inside(found["is"])
    ]


def _has_inside(schema: Schema) -> bool:
    parts = [schema, *schema.get("anyOf", ()), *schema.get("oneOf", ())]
    kinds = [part.get("type") for part in parts]
    return any(kind in ("array", "object") for kind in kinds) or any(
        "$ref" in part or "oneOf" in part for part in parts
    )


class _Tidy:
    """Brings pydantic's schemas into one form, and collects their definitions.

    Attributes:
        definitions: every model by its class's name.
    """

    def __init__(self) -> None:
        self.definitions: Schema = {}

    def model(self, schema: Schema) -> Schema:
        """Return a model's schema; what it refers to goes to the definitions."""
        for name, definition in schema.pop("$defs", {}).items():
            self.definitions[name] = self._object(definition)
        return self._object(schema)

    def _object(self, schema: Schema) -> Schema:
        tidy = {key: self._value(key, value) for key, value in schema.items() if key != "title"}
        if "properties" in schema:
            tidy["properties"] = {
                name: self._schema(own) for name, own in schema["properties"].items()
            }
            tidy["description"] = schema.get("description", "").partition("\n\n")[0]
        return tidy

    def _schema(self, schema: Schema) -> Schema:
        if "properties" in schema and "title" in schema:
            # An entry that is described in place: it gets its name, like all others.
            self.definitions[schema["title"]] = self._object(schema)
            return {"$ref": _REF + schema["title"]}
        tidy = {
            _BOUNDS.get(key, key): self._value(key, value)
            for key, value in schema.items()
            if key not in ("title", "discriminator")
        }
        if "$ref" in tidy and isinstance(tidy.get("default"), dict):
            del tidy["default"]
        least = tidy.get("minimum", tidy.get("exclusiveMinimum", -1))
        if "pattern" in tidy and least >= 0:
            tidy["pattern"] = tidy["pattern"].replace("[-+]?", "", 1)
        return tidy

    def _value(self, key: str, value: Any) -> Any:
        if key in ("anyOf", "oneOf", "prefixItems"):
            return [self._schema(part) for part in value]
        if key in ("items", "additionalProperties") and isinstance(value, dict):
            return self._schema(value)
        return value
