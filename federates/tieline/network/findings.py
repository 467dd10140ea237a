"""Gathers what is wrong with a topology file, each with its line and the nearest valid word."""

from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import ValidationError

from tieline.errors import InputError
from tieline.network.entry import Entry
from tieline.network.schema import TAGGED, allowed_keys
from tieline.problems import value_at
from tieline.yaml_lines import Document, Position

AnEntry = TypeVar("AnEntry", bound=Entry)


class Findings:
    """The findings of one document, or of what an experiment adds to it.

    Args:
        document: the file.
        prefix: put before every name, in place of file and line, where there is no file.
    """

    def __init__(self, document: Document, prefix: str = "") -> None:
        self.document = document
        self._prefix = prefix
        self.found: list[tuple[int, str]] = []

    def add(self, position: Position, sentence: str) -> None:
        """Note what is wrong at a position."""
        self.found.append((self.document.line(position), sentence))

    def lines(self) -> list[str]:
        """Return all findings in the order of lines, each once."""
        ordered = sorted(self.found, key=lambda finding: finding[0])
        path = self.document.path
        return list(
            dict.fromkeys(
                f"{self._prefix}{text}" if self._prefix else f"{path}:{line}: {text}"
                for line, text in ordered
            )
        )

    def refuse(self) -> None:
        """Raise InputError with all findings, if there are any."""
        if self.found:
            raise InputError(self.lines())

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
            self._unknown(kind, given, allowed, position)

    def entry(self, value: Any, position: Position, model: type[AnEntry]) -> AnEntry | None:
        """Return a checked entry, or none and the findings."""
        folder = self.document.path.parent
        try:
            return model.model_validate(value, context={"folder": folder})
        except ValidationError as error:
            for detail in error.errors(include_url=False):
                self._detail(detail, position, model)
            return None

    def tagged(
        self, value: Any, position: Position, tag: str, models: Mapping[str, type[Entry]]
    ) -> Entry | None:
        """Return a checked entry of the kind that its tag says, or none and the findings."""
        name = ".".join(str(part) for part in position)
        if not isinstance(value, dict):
            self.add(position, f"{name} must hold keys and values (got {_shown(value)})")
        elif tag not in value:
            self.add(position, f"{name} lacks '{tag}' (allowed: {', '.join(models)})")
        elif not isinstance(value[tag], str) or value[tag] not in models:
            self._unknown(tag, value[tag], models, (*position, tag))
        else:
            return self.entry(value, position, models[value[tag]])
        return None

    def _unknown(self, kind: str, given: Any, allowed: Collection[str], position: Position) -> None:
        # Where there is no line to say where, the sentence must.
        name = f"{'.'.join(str(part) for part in position)}: " if self._prefix else ""
        self.add(position, f"{name}unknown {kind} '{given}'{nearest(given, allowed)}")

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
            # As the file says it: what pydantic was handed may be converted by then.
            stated = value_at(self.document.data, (*position, *inner))
            value = detail["input"] if isinstance(stated, dict | list | None) else stated
            given = "" if "(got " in reason else f" (got {_shown(value)})"
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
    return f" (allowed: {', '.join(allowed)})" if len(allowed) <= 16 else ""


def _model_at(location: tuple[Any, ...], model: type[Entry]) -> type[Entry]:
    """Return the model that refused a key: the kind of entry last passed, or `model`."""
    for part in reversed(location[:-1]):
        for kinds in TAGGED.values():
            if part in kinds:
                return kinds[part]
    return model


def _reason(detail: Any) -> str:
    """Return what pydantic found as the continuation of `name ...`."""
    if detail["type"].startswith("union_tag"):
        tag = detail["ctx"]["discriminator"].strip("'")
        return f"must have a '{tag}' of {', '.join(TAGGED[tag])}"
    if detail["type"] in ("model_type", "model_attributes_type"):
        return "must hold keys and values"
    message = detail["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    return str(message[:1].lower() + message[1:])


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
