"""The reference page of every setting, written from the JSON Schema."""

import re
from collections.abc import Iterator
from typing import Any

from tieline.experiment.json_schema import Schema, json_schema, target
from tieline.experiment.layers import EXTENDS

HEAD = """\
# Every setting of an experiment

An experiment is a YAML file. This page is written by `tieline schema --markdown` from the
declarations that also check the file; `tieline schema` prints them as JSON Schema.

A quantity is a plain number, which counts in the unit of its row, or text with a unit: `250 ms`,
`2 Mbit/s`, `1.4 GW`, `2 %`. The units are

{units}

What says 'none' may be `null`, which is also how a file takes back a setting of one that it
extends. A dotted key, as `network.mean_delay`, names a setting in `--set` and in a sweep.
"""

_UNITS = {
    "s": "s, ms, us, ns, min",
    "bit/s": "bit/s, kbit/s, Mbit/s, Gbit/s",
    "Hz": "Hz, kHz, mHz",
    "MW": "MW, GW, kW",
    "B": "B, kB, MB, GB",
    "1": "%",
}
_TAGS = ("discipline", "distribution", "model", "kind")
_WORDS = {
    "string": "text",
    "integer": "whole number",
    "number": "number",
    "boolean": "`true` or `false`",
    "null": "none",
    "any": "",
}
_LIMITS = (("exclusiveMinimum", ">"), ("minimum", "≥"), ("exclusiveMaximum", "<"), ("maximum", "≤"))


def reference_page() -> str:
    """Return the page as Markdown: one table for each group and each kind of entry."""
    schema = json_schema()
    units = "\n".join(f"- {units}" for units in _UNITS.values())
    parts = [HEAD.format(units=units)]
    for title, group in _sections(schema):
        about = " ".join(group["description"].split())
        parts += [f"## {title}\n", f"{about}\n", _table(group, schema["$defs"])]
    return "\n".join(parts)


def _sections(schema: Schema) -> Iterator[tuple[str, Schema]]:
    """Yield (title, group) of every group and entry, each before what it leads to."""
    yield "The file", schema
    seen: set[str] = set()
    waiting = list(_references(schema, ""))
    while waiting:
        path, name = waiting.pop(0)
        if name in seen or "properties" not in schema["$defs"][name]:
            found = schema["$defs"][name]
            waiting[:0] = [] if name in seen else list(_references(found, path, is_entry=True))
            seen.add(name)
            continue
        seen.add(name)
        group = schema["$defs"][name]
        tag = _tag(group, path)
        yield f"{path}: {tag}" if tag else path, group
        waiting[:0] = list(_references(group, path))


def _references(group: Schema, path: str, is_entry: bool = False) -> Iterator[tuple[str, str]]:
    """Yield (path, definition) of all that a group's settings refer to."""
    if is_entry:
        yield from ((path, name) for name in _names(group))
    for key, own in group.get("properties", {}).items():
        below = f"{path}.{key}" if path else key
        yield from ((below, name) for name in _names(own))


def _names(schema: Any) -> Iterator[str]:
    if isinstance(schema, dict):
        reference = schema.get("$ref", "")
        if reference.startswith("#/$defs/") and reference.count("/") == 2:
            yield reference.rsplit("/", 1)[1]
        for key, value in schema.items():
            if key != "properties":
                yield from _names(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from _names(value)


def _tag(group: Schema, path: str) -> str:
    """Return the word that tells an entry from the others of its place; empty for a group."""
    properties = group["properties"]
    for tag in _TAGS:
        if "const" in properties.get(tag, {}):
            return str(properties[tag]["const"])
    if path.startswith(("grid.events", "sweep.over")):
        return next(name for name in properties if name not in ("at", "when"))
    return "a point" if "label" in properties else ""


def _table(group: Schema, defs: Schema) -> str:
    lines = ["| setting | unit | values | default | what it is |", "|---|---|---|---|---|"]
    if "label" in group["properties"]:
        any_other: Schema = {"description": "any setting, by its dotted key, and its value here"}
        keys = {"label": group["properties"]["label"], "DOTTED.KEY": any_other}
    else:
        keys = group["properties"]
    required = group.get("required", ())
    unless = {name for choice in group.get("anyOf", ()) for name in choice["required"]} - {EXTENDS}
    for name, own in keys.items():
        default = "required" if name in required else _default(own)
        default = "required without extends" if name in unless else default
        values = _values(own, defs)
        cells = (f"`{name}`", _unit(own), values, default, own.get("description", ""))
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _default(own: Schema) -> str:
    if "default" not in own:
        return ""
    value = own["default"]
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.15g}"
    return "empty" if value in ([], {}) else f"`{value}`" if isinstance(value, str) else str(value)


def _unit(own: Schema) -> str:
    units = [part["unit"] for part in _parts(own) if "unit" in part]
    unit = units[0] if units else ""
    return {"number": "", "1": "1 or %" if "(%)" in str(own) else "1"}.get(unit, unit)


def _parts(own: Any) -> Iterator[Schema]:
    """Yield a schema and all that it holds, but what it refers to."""
    if isinstance(own, dict):
        yield own
        for value in own.values():
            yield from _parts(value)
    elif isinstance(own, list):
        for value in own:
            yield from _parts(value)


def _values(own: Schema, defs: Schema) -> str:
    """Return in words what a setting may be."""
    choices = own.get("anyOf") or own.get("oneOf")
    if choices:
        words = dict.fromkeys(_values(choice, defs) for choice in choices)
        return " or ".join(filter(None, words))
    if "const" in own:
        return f"`{own['const']}`"
    if "enum" in own:
        return ", ".join(f"`{word}`" for word in own["enum"])
    if "$ref" in own:
        return _referred(own, defs)
    kinds = own.get("type", "any")
    kind = kinds[0] if isinstance(kinds, list) else kinds
    if kind in ("array", "object"):
        return _several(own, kind, defs)
    limits = " and ".join(f"{sign} {_number(own[key])}" for key, sign in _LIMITS if key in own)
    return f"{_WORDS[kind]} {limits}".strip()


def _referred(own: Schema, defs: Schema) -> str:
    group = target(own, defs)
    if "properties" not in group:
        return _values(group, defs)
    is_event = {"at", "when"} <= set(group["properties"])
    tag = _tag(group, "grid.events" if is_event else "")
    return f"`{tag}`" if tag else "a group"


def _several(own: Schema, kind: str, defs: Schema) -> str:
    if "prefixItems" in own:
        return "pairs of text"
    inner = own.get("items" if kind == "array" else "additionalProperties")
    words = _values(inner, defs) if isinstance(inner, dict) else ""
    name = "list" if kind == "array" else "group"
    return f"{name} of {words}" if words else name


def _number(value: float) -> str:
    return f"{value:.15g}" if abs(value) < 1e6 else re.sub(r"e\+0*", "e", f"{value:.3g}")
