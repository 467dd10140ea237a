"""Finds recorded quantities by name or pattern."""

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tieline.errors import InputError
from tieline.experiment.results import Run
from tieline.problems import near
from tieline.tables import units_of

TABLE = "grid"
TIME = "t_s"
MOST_CURVES = 200


@dataclass(frozen=True)
class Quantity:
    """One recorded column: its name, unit, description, and a factor to the unit."""

    name: str
    unit: str
    description: str
    scale: float = 1.0

    @property
    def kind(self) -> str:
        """What it is without the element it belongs to: quantities of one kind share axes."""
        return self.name.partition(".")[0]

    @property
    def element(self) -> str:
        """The unit or bus it belongs to; empty for what is of the whole system."""
        return self.name.partition(".")[2]


def recorded(run: Run) -> dict[str, Quantity]:
    """Return everything that a run recorded against time, by its name."""
    path = run.folder / f"{TABLE}.parquet"
    return {
        name: Quantity(name, unit, description)
        for name, (unit, description) in units_of(path).items()
        if name != TIME
    }


def chosen(runs: Sequence[Run], patterns: Sequence[str]) -> list[Quantity]:
    """Return the quantities that some patterns name, in the order of the patterns, each once.

    Args:
        runs: at least one; a quantity must be in at least one of them.
        patterns: names such as `speed_pu.G26`, or with `*`, `?` and `[...]`; a kind alone, such as
            `speed_pu`, means all of it.

    Raises:
        InputError: a pattern fits nothing, or they fit more than can be drawn.
    """
    known: dict[str, Quantity] = {}
    for run in runs:
        known |= recorded(run)
    found: dict[str, Quantity] = {}
    missing = []
    for pattern in patterns:
        fitting = _fitting(known, pattern)
        found |= {quantity.name: quantity for quantity in fitting}
        if not fitting:
            missing.append(_unknown(pattern, known))
    if missing:
        raise InputError(missing)
    if len(found) * len(runs) > MOST_CURVES:
        raise InputError(
            f"{len(found)} quantities of {len(runs)} runs are more than {MOST_CURVES} curves:"
            " give fewer, or fewer runs (FOLDER:LABEL)"
        )
    return list(found.values())


def _fitting(known: Mapping[str, Quantity], pattern: str) -> list[Quantity]:
    if pattern in known:
        return [known[pattern]]
    by_kind = [quantity for quantity in known.values() if quantity.kind == pattern]
    return by_kind or [known[name] for name in known if fnmatch.fnmatchcase(name, pattern)]


def _unknown(pattern: str, known: Mapping[str, Quantity]) -> str:
    kinds = list(dict.fromkeys(quantity.kind for quantity in known.values()))
    return (
        f"nothing recorded is called '{pattern}'{near(pattern, [*known, *kinds])}"
        f" (kinds: {', '.join(kinds)}; the part after the dot is a unit or a bus)"
    )
