"""An experiment in full: every setting with its default, as a file that says the same."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from tieline.experiment.layers import shortest
from tieline.experiment.load import Study
from tieline.experiment.sweep import Point
from tieline.units import dimension_of, unit_of


def as_yaml(study: Study) -> str:
    """Return an experiment file that needs no other: what it extends and all defaults are in it.

    Quantities carry their units. A sweep is the list of its points.
    """
    files = " extends ".join(shortest(document.path) for document in study.sources.layers.documents)
    count = f", {len(study.points)} points" if study.is_sweep else ""
    lines = [f"# {study.name}{count}: {files}, with every default"]
    lines += [f"# {option.where}" for option in study.sources.options]
    content = plain(study.base)
    if study.is_sweep:
        content["sweep"] = [_listed(point) for point in study.points]
    text = yaml.safe_dump(
        content, sort_keys=False, default_flow_style=None, width=100, allow_unicode=True
    )
    return "\n".join(lines) + f"\n{text}"


def as_data(study: Study) -> dict[str, Any]:
    """Return an experiment as JSON holds it: plain numbers, and the points with their settings."""
    found: dict[str, Any] = {
        "files": [str(document.path) for document in study.sources.layers.documents],
        "experiment": study.base.model_dump(mode="json", by_alias=True),
    }
    if study.is_sweep:
        found["points"] = [
            {"label": point.label, "slug": point.slug, "settings": _settings(point)}
            for point in study.points
        ]
    return found


def plain(model: BaseModel, has_nulls: bool = True) -> dict[str, Any]:
    """Return a model's settings by their keys; quantities as text with their unit.

    Args:
        model: the settings.
        has_nulls: whether settings that are none are there, too.
    """
    found = {}
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if value is not None or has_nulls:
            found[field.alias or name] = _plain(value, unit_of(field))
    return found


def _plain(value: Any, unit: str | None) -> Any:
    if isinstance(value, BaseModel):
        return plain(value)
    if isinstance(value, list | tuple):
        return [
            plain(entry, has_nulls=False) if isinstance(entry, BaseModel) else _plain(entry, unit)
            for entry in value
        ]
    if isinstance(value, Mapping):
        return {key: _plain(inner, unit) for key, inner in value.items()}
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float):
        return f"{value:.15g} {unit}" if unit and dimension_of(unit) else _number(value)
    return value


def _number(value: float) -> int | float:
    """Return a number without a decimal point that says nothing."""
    return int(value) if value.is_integer() and abs(value) < 1e15 else value


def _listed(point: Point) -> dict[str, Any]:
    return {"label": point.label, **_settings(point)}


def _settings(point: Point) -> dict[str, Any]:
    return {".".join(map(str, each.path)): each.value for each in point.overrides}
