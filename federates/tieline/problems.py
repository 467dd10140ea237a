"""Turns what pydantic found into sentences: where, what was given, what is allowed."""

import difflib
import pathlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from tieline.units import QuantityError, dimension_of, unit_of

Path = tuple[str | int, ...]
Model = TypeVar("Model", bound=BaseModel)
_Error = Mapping[str, Any]


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong: the settings it concerns, the first of them to blame, and a text."""

    paths: tuple[Path, ...]
    text: str


def dotted(path: Path) -> str:
    """Return a path as it is written: `grid.events[0].at`."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def near(given: object, allowed: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` with the nearest allowed word, or nothing if none is near."""
    by_lower = {word.lower(): word for word in allowed}
    found = difflib.get_close_matches(str(given).lower(), list(by_lower), n=1, cutoff=0.55)
    return f"; did you mean '{by_lower[found[0]]}'?" if found else ""


def checked(
    model: type[Model], data: object, folder: pathlib.Path | None = None
) -> tuple[Model | None, list[Problem]]:
    """Return the model that the data describe, or None, and every problem found.

    Args:
        model: what they should be.
        data: lists, groups and single values, as a file has them.
        folder: where files that the data name are looked for; else the working folder.
    """
    try:
        return model.model_validate(data, context={"folder": folder or pathlib.Path()}), []
    except ValidationError as error:
        found: dict[Path, list[_Error]] = {}
        for item in error.errors(include_url=False):
            found.setdefault(_data_path(item, data), []).append(item)
        return None, [
            _problem(model, data, path, items)
            for path, items in found.items()
            if not _is_explained_deeper(path, data, found)
            and not (items[0]["type"] == "missing" and _is_misspelt(path, found))
        ]


_OF_KEYS = ("missing", "extra_forbidden", "invalid_key")


def _data_path(error: _Error, data: Any) -> Path:
    """Return where in the data an error stands: pydantic's location without the names of unions."""
    return _aligned(error["loc"], data, error["type"] in _OF_KEYS)[1]


def _aligned(location: Path, data: Any, is_of_key: bool) -> tuple[int, Path]:
    """Return how few parts of a location must be left out to follow it in the data, and the rest.

    A union's branch may have the name of a key, so that each part may be either.
    """
    if not location:
        return 0, ()
    part, rest = location[0], location[1:]
    if is_of_key and not rest:
        return int(not isinstance(data, dict)), (part,)
    left_out, path = _aligned(rest, data, is_of_key)
    best = left_out + 1, path
    inside = value_at(data, (part,))
    if inside is not None or (isinstance(data, dict) and part in data):
        left_out, path = _aligned(rest, inside, is_of_key)
        best = min(best, (left_out, (part, *path)), key=lambda found: found[0])
    return best


def _is_explained_deeper(path: Path, data: Any, found: Iterable[Path]) -> bool:
    """Return whether a list failed only because of members that are reported themselves."""
    is_list = isinstance(value_at(data, path), list)
    return is_list and any(other[: len(path)] == path and other != path for other in found)


def _is_misspelt(path: Path, found: Mapping[Path, Sequence[_Error]]) -> bool:
    """Return whether a key is missing only because it is there with a letter wrong."""
    beside = [
        other
        for other, errors in found.items()
        if other[:-1] == path[:-1] and errors[0]["type"] == "extra_forbidden"
    ]
    return any(near(other[-1], [str(path[-1])]) for other in beside)


def _problem(model: type[BaseModel], data: Any, path: Path, errors: Sequence[_Error]) -> Problem:
    if errors[0]["type"] == "union_tag_not_found":
        place, text = _unclear(model, path, value_at(data, path))
        return Problem((place,), text)
    return Problem((path,), _sentence(model, data, path, errors))


def has_keys(model: type[BaseModel], path: Path) -> bool:
    """Return whether a group of keys may stand at a path of a model's data."""
    return bool(_models_at(model, path))


def _sentence(model: type[BaseModel], data: Any, path: Path, errors: Sequence[_Error]) -> str:
    first, kind = errors[0], errors[0]["type"]
    where = dotted(path)
    if kind in ("extra_forbidden", "invalid_key"):
        return _unknown_key(model, path)
    if kind == "missing":
        about = _description(model, path)
        return f"missing key '{where}'" + (f": {about}" if about else "")
    given = value_at(data, path)
    if kind == "value_error" and len(errors) == 1:
        return f"{where} {first['ctx']['error']}"
    unit = _unit(model, path)
    allowed = " or ".join(dict.fromkeys(_allowed(error, unit) for error in errors))
    words = [word for error in errors for word in _words(error)]
    hint = near(given, words) if isinstance(given, str) else ""
    return f"{where or 'an experiment'} must be {allowed} (got {_shown(given)}{hint})"


def _unknown_key(model: type[BaseModel], path: Path) -> str:
    key, parent = str(path[-1]), path[:-1]
    beside = list(_fields(model, parent))
    elsewhere = [name for name in _all_keys(model) if name.split(".")[-1] == key]
    hint = f"; did you mean '{elsewhere[0]}'?" if elsewhere else near(key, beside)
    place = f" in {dotted(parent)}" if parent else ""
    return f"unknown key '{key}'{place} ({(hint or '; allowed: ' + ', '.join(beside))[2:]})"


def _unclear(model: type[BaseModel], path: Path, given: object) -> tuple[Path, str]:
    """Return what is unclear about a group that must be one of several kinds, and where."""
    models = _models_at(model, path)
    fields = [set(kind.model_fields) for kind in models]
    common = set.intersection(*fields) if fields else set()
    own = [[name for name in kind.model_fields if name not in common] for kind in models]
    kinds = [names[0] for names in own if names]
    where = dotted(path)
    if not kinds:
        # A strange key, such as the number 0, was taken for a part of the path.
        return path, f"{where} is not understood (got {_shown(given)})"
    if not isinstance(given, dict):
        keys = "at, and " if "at" in common else ""
        text = f"{where} must be a group of keys: {keys}{' or '.join(kinds)}"
        return path, f"{text} (got {_shown(given)})"
    strange = [key for key in given if key not in _fields(model, path)]
    hints = [(key, hint) for key in strange if (hint := near(key, kinds))]
    if hints and not any(kind in given for kind in kinds):
        key, hint = hints[0]
        return (*path, key), f"unknown key '{key}' in {where} ({hint[2:]})"
    keys = ", ".join(map(str, given)) or "none"
    return path, f"{where} must have just one of {', '.join(kinds)} (got {keys})"


_BOUNDS = {
    "greater_than": ("gt", "greater than {}"),
    "greater_than_equal": ("ge", "{} or more"),
    "less_than": ("lt", "less than {}"),
    "less_than_equal": ("le", "{} or less"),
}

_KINDS = {
    "int": "a whole number",
    "float": "a number",
    "string": "text",
    "bool": "true or false",
    "list": "a list",
    "tuple": "a list",
    "model": "a group of keys",
    "dict": "a group of keys",
    "finite": "a finite number",
}


def _allowed(error: _Error, unit: str) -> str:
    kind, context = error["type"], error.get("ctx", {})
    if kind in _BOUNDS:
        key, text = _BOUNDS[kind]
        return text.format(f"{context[key]:.15g}{unit}")
    if kind == "literal_error":
        words = _words(error)
        return f"one of {', '.join(words)}" if len(words) > 1 else f"'{words[0]}'"
    if kind == "value_error":
        reason = context["error"]
        return reason.allowed if isinstance(reason, QuantityError) else str(reason)
    if kind in ("too_short", "string_too_short"):
        least = context["min_length"]
        return "not empty" if least == 1 else f"at least {least} long"
    if kind == "too_long" or kind == "string_too_long":
        return f"at most {context['max_length']} long"
    if kind == "string_pattern_mismatch":
        return "letters, digits, _ and -, beginning with a letter or digit"
    return _KINDS.get(kind.split("_")[0], str(error["msg"]))


def _words(error: _Error) -> list[str]:
    if error["type"] != "literal_error":
        return []
    return [word.strip("'") for word in error["ctx"]["expected"].replace(" or ", ", ").split(", ")]


def _shown(value: object) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        return f"keys {', '.join(map(str, value))}"
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def value_at(data: Any, path: Sequence[Any]) -> Any:
    """Return the value at a path, or None where the data do not have it."""
    for part in path:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]


def _models_at(model: type[BaseModel], path: Path) -> list[type[BaseModel]]:
    """Return every model that may stand at a path; keys of a mapping are passed by."""
    models = [model]
    is_mapping = False
    for part in path:
        if isinstance(part, str) and not is_mapping:
            fields = [kind.model_fields[part] for kind in models if part in kind.model_fields]
            models = [found for field in fields for found in _models_in(field.annotation)]
            is_mapping = any(get_origin(field.annotation) is dict for field in fields)
        else:
            is_mapping = False
    return models


def _fields(model: type[BaseModel], path: Path) -> dict[str, Any]:
    """Return the fields allowed at a path, of every model that may stand there."""
    models = _models_at(model, path)
    return {name: field for kind in models for name, field in kind.model_fields.items()}


def _unit(model: type[BaseModel], path: Path) -> str:
    """Return ` s`, or whatever unit the setting at a path may be written with, or nothing."""
    named = [part for part in path if isinstance(part, str)]
    field = _fields(model, tuple(named[:-1])).get(named[-1]) if named else None
    unit = None if field is None else unit_of(field)
    return f" {unit}" if unit and dimension_of(unit) else ""


def _description(model: type[BaseModel], path: Path) -> str | None:
    if not path or not isinstance(path[-1], str):
        return None
    field = _fields(model, path[:-1]).get(path[-1])
    return field.description if field else None


def _all_keys(model: type[BaseModel], prefix: str = "") -> list[str]:
    keys = []
    for name, field in model.model_fields.items():
        keys.append(prefix + name)
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            keys += _all_keys(field.annotation, f"{prefix}{name}.")
    return keys
