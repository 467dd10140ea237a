"""Gathers what is wrong with a topology file, each with its line and the nearest valid word."""

from collections.abc import Collection, Sequence
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import ValidationError

from tieline.errors import InputError
from tieline.network.schema import JITTERS, Entry, allowed_keys
from tieline.yaml_lines import Document, Position

AnEntry = TypeVar("AnEntry", bound=Entry)


class Findings:
    """The findings of one document."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.found: list[tuple[int, str]] = []

    def add(self, position: Position, sentence: str) -> None:
        """Note what is wrong at a position."""
        self.found.append((self.document.line(position), sentence))

    def refuse(self) -> None:
        """Raise InputError with all findings in the order of lines, if there are any."""
        if self.found:
            ordered = sorted(self.found, key=lambda finding: finding[0])
            lines = (f"{self.document.path}:{line}: {text}" for line, text in ordered)
            raise InputError(dict.fromkeys(lines))

    def section(self, value: Any, position: Position, kind: type) -> Any:
        """Return a value that must be a list or a mapping, or an empty one and a finding."""
        if isinstance(value, kind):
            return value
        expected = "a list" if kind is list else "keys and values"
        name = f"'{position[-1]}'" if position else "the file"
        self.add(position, f"{name} must hold {expected} (got {_shown(value)})")
        return kind()

    def keys(
        self,
        value: dict[Any, Any],
        position: Position,
        allowed: Sequence[str],
        required: Sequence[str] = (),
    ) -> None:
        """Note the unknown keys of a mapping and those that it lacks."""
        for key in value:
            self.word(key, allowed, (*position, key), "key")
        for key in required:
            if key not in value:
                self.add(position, f"'{key}' is missing")

    def word(self, given: Any, allowed: Collection[str], position: Position, kind: str) -> None:
        """Note a word that is none of the allowed ones, with the nearest of them."""
        if given not in allowed:
            self.add(position, f"unknown {kind} '{given}'{nearest(given, allowed)}")

    def entry(self, value: Any, position: Position, model: type[AnEntry]) -> AnEntry | None:
        """Return a checked entry, or none and the findings."""
        try:
            return model.model_validate(value)
        except ValidationError as error:
            for detail in error.errors(include_url=False):
                self._detail(detail, position, model)
            return None

    def _detail(self, detail: Any, position: Position, model: type[Entry]) -> None:
        inner = self._existing(position, detail["loc"])
        name = ".".join(str(part) for part in (*position, *inner))
        if detail["type"] == "extra_forbidden":
            keys = allowed_keys(_model_at(detail["loc"], model))
            self.word(inner[-1], keys, (*position, *inner), "key")
        elif detail["type"] == "missing":
            missing = detail["loc"][-1]
            self.add((*position, *inner), f"{name} lacks '{missing}'")
        else:
            reason = _reason(detail)
            given = "" if "(got " in reason else f" (got {_shown(detail['input'])})"
            self.add((*position, *inner), f"{name} {reason}{given}")

    def _existing(self, position: Position, location: tuple[Any, ...]) -> Position:
        """Return the parts of a pydantic location that the document has; tags fall out."""
        value = self.document.data
        for part in position:
            value = value[part]
        parts = []
        for part in location:
            known = range(len(value)) if isinstance(value, list) else value
            if isinstance(value, dict | list) and part in known:
                value = value[part]
                parts.append(part)
        return tuple(parts)


def nearest(given: Any, allowed: Collection[str]) -> str:
    """Return ` (did you mean 'x'?)` for the nearest allowed word, or the whole short list."""
    matches = get_close_matches(str(given), allowed, n=1)
    if matches:
        return f" (did you mean '{matches[0]}'?)"
    return f" (allowed: {', '.join(allowed)})" if len(allowed) <= 12 else ""


def _model_at(location: tuple[Any, ...], model: type[Entry]) -> type[Entry]:
    """Return the model that refused a key: a jitter's if the location passes one, else `model`."""
    inside = [part for part in location[:-1] if part in JITTERS]
    return JITTERS[inside[-1]] if inside else model


def _reason(detail: Any) -> str:
    """Return what pydantic found as the continuation of `name ...`."""
    if detail["type"].startswith("union_tag"):
        return f"must have a 'distribution' of {', '.join(JITTERS)}"
    if detail["type"] in ("model_type", "model_attributes_type"):
        return "must hold keys and values"
    message = detail["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return str(message[:1].lower() + message[1:])


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
