"""The reference of all device models, made from their declarations."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from tieline.grid.models.base import ROLES, Model, Parameter
from tieline.grid.models.registry import models

PLURALS = {
    "machine": "Machines",
    "exciter": "Exciters",
    "governor": "Governors",
    "pss": "Power system stabilisers",
}
"""Titles of the roles."""


@dataclass(frozen=True)
class Entry:
    """One model as its class declares it; `about` is the first sentence of its docstring."""

    role: str
    key: str
    about: str
    source: str
    states: tuple[str, ...]
    parameters: tuple[Parameter, ...]


def entries(role: str | None = None) -> Iterator[Entry]:
    """Yield every model, by role and name; only those of one role if it is given."""
    for each in ROLES if role is None else (role,):
        for key, model in sorted(models(each).items()):
            yield _entry(each, key, model)


def _entry(role: str, key: str, model: type[Model]) -> Entry:
    about = (model.__doc__ or "").strip().partition("\n\n")[0]
    return Entry(role, key, " ".join(about.split()), model.source, model.states, model.parameters)


def as_text(entry: Entry) -> str:
    """Return an entry as text: name, source, states and one line a parameter."""
    lines = [
        f"{entry.role} {entry.key}",
        f"  {entry.about}",
        f"  source: {entry.source}",
        f"  states: {', '.join(entry.states) or 'none'}",
    ]
    rows = [(p.symbol, "" if p.unit == "1" else p.unit, p.bounds, p.text) for p in entry.parameters]
    widths = [max((len(row[i]) for row in rows), default=0) for i in range(3)]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        lines.append(f"    {'  '.join(cells)}  {row[3]}")
    return "\n".join(lines)


def as_markdown(listed: Iterable[Entry]) -> str:
    """Return entries as a page of the documentation, a section a model."""
    blocks = [
        "# Device models",
        "Made by `tieline models --markdown` from what each model declares. Parameters are per unit"
        " on the device's own base unless a unit is given.",
    ]
    role = None
    for entry in listed:
        if entry.role != role:
            role = entry.role
            blocks.append(f"## {PLURALS[role]}")
        blocks += [
            f"### {entry.key}",
            entry.about,
            f"Source: {entry.source}. States: {', '.join(entry.states) or 'none'}.",
        ]
        rows = [
            f"| {p.symbol} | {'' if p.unit == '1' else p.unit} | {p.bounds} | {p.text} |"
            for p in entry.parameters
        ]
        if rows:
            blocks.append(
                "\n".join(["| parameter | unit | bounds | meaning |", "|---|---|---|---|", *rows])
            )
    return "\n\n".join(blocks)
