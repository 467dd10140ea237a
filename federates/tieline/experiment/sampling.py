"""The sweep block: settings varied together, on a grid or drawn, from seeds that the file names."""

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictInt, model_validator

from tieline.experiment.axes import AnyAxis
from tieline.streams import stream
from tieline.units import Unit

MOST_POINTS = 10_000
"""Points of a sweep at most: each is a run of seconds at least, and a folder."""

LONGEST_SLUG = 80
LONGEST_VALUE = 40


class SweepBlock(BaseModel):
    """Settings varied together: every combination, or points drawn at random."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    method: Literal["grid", "random", "latin_hypercube"] = Field(
        description=(
            "grid: every combination of the values; random: each point drawn by itself; "
            "latin_hypercube: drawn so that each setting covers its range evenly"
        )
    )
    points: Annotated[StrictInt, Unit("points")] | None = Field(
        None,
        ge=1,
        le=MOST_POINTS,
        description="how many points are drawn; a grid has as many as it has combinations",
    )
    seed: Annotated[StrictInt, Unit("number")] | None = Field(
        None, ge=0, lt=2**63, description="seed of the draws; none takes the experiment's"
    )
    own_seeds: StrictBool = Field(
        False,
        description=(
            "whether each point has an experiment seed of its own, drawn too; otherwise all share "
            "the experiment's, and with it the same random traffic, jitter and loss where they can"
        ),
    )
    over: dict[str, AnyAxis] = Field(
        min_length=1,
        description="the settings by their dotted keys, each with its values or distribution",
    )

    @model_validator(mode="after")
    def _fits_its_method(self) -> Self:
        if self.own_seeds and "seed" in self.over:
            raise ValueError("cannot vary 'seed' and have own_seeds: leave one of them out")
        if self.method != "grid":
            if self.points is None:
                raise ValueError(f"must say how many 'points' method {self.method} draws")
            return self
        if self.points is not None:
            raise ValueError("must not say 'points': a grid has one for each combination")
        drawn = [key for key, axis in self.over.items() if axis.values() is None]
        if drawn:
            raise ValueError(
                f"with method grid must have values for '{drawn[0]}': a list, linspace or"
                " logspace; random and latin_hypercube draw from distributions"
            )
        count = math.prod(len(axis.values() or ()) for axis in self.over.values())
        if count > MOST_POINTS:
            raise ValueError(f"must have at most {MOST_POINTS} points (its grid has {count})")
        return self


class SweepFile(BaseModel):
    """An experiment file's sweep block in its place."""

    sweep: SweepBlock


SEEDS = "seeds of sweep points"
"""The stream of the points' own seeds."""


@dataclass(frozen=True)
class Row:
    """One point to be: its names, and the settings that it has in place of the experiment's."""

    label: str
    slug: str
    settings: dict[str, Any]


def rows(block: SweepBlock, seed: int) -> list[Row]:
    """Return the points of a sweep block in order.

    Every setting has a random generator of its own, named after it: the same file gives the same
    points anywhere, and one setting more leaves the draws of the others as they are.

    Args:
        block: the sweep.
        seed: the experiment's, which counts unless the block has its own.
    """
    seed = seed if block.seed is None else block.seed
    keys = list(block.over)
    values = list(_combinations(block) if block.method == "grid" else _draws(block, seed))
    width = len(str(len(values)))
    numbers = [str(number).zfill(width) for number in range(1, len(values) + 1)]
    settings = [dict(zip(keys, row, strict=True)) for row in values]
    labels, slugs = numbers, numbers
    if block.method == "grid":
        labels = [_label(short_names(keys), row) for row in values]
        if len(set(labels)) < len(labels):
            labels = [f"{number}: {label}" for number, label in zip(numbers, labels, strict=True)]
        slugs = _slugs(labels, numbers)
    if block.own_seeds:
        own = stream(seed, SEEDS).integers(0, 2**31, len(values))
        settings = [{**row, "seed": int(own[i])} for i, row in enumerate(settings)]
    return [Row(*row) for row in zip(labels, slugs, settings, strict=True)]


def streams_of(block: SweepBlock, seed: int) -> dict[str, Any]:
    """Return the seed of a block's draws and the names of its random streams."""
    names: list[str] = []
    if block.method != "grid":
        kind = "sweep" if block.method == "random" else "latin hypercube"
        names = [f"{kind} over {key}" for key in block.over]
    if block.own_seeds:
        names.append(SEEDS)
    return {"seed": seed if block.seed is None else block.seed, "names": names}


def slug_of(label: str) -> str:
    """Return a folder's name for a label; empty if it has no letter or digit."""
    return re.sub(r"[^a-z0-9.]+", "-", label.lower()).strip("-.")


def short_names(keys: Sequence[str]) -> list[str]:
    """Return the shortest ends of dotted keys that tell them apart."""
    parts = [key.split(".") for key in keys]
    depth = 1
    while len({tuple(part[-depth:]) for part in parts}) < len(keys):
        depth += 1
    return [".".join(part[-depth:]) for part in parts]


def _combinations(block: SweepBlock) -> Iterator[tuple[Any, ...]]:
    """Yield every combination; the last setting changes fastest."""
    return itertools.product(*(axis.values() or () for axis in block.over.values()))


def _draws(block: SweepBlock, seed: int) -> Iterator[tuple[Any, ...]]:
    assert block.points is not None
    columns = [
        [axis.at(share) for share in _shares(block.method, block.points, seed, key).tolist()]
        for key, axis in block.over.items()
    ]
    return zip(*columns, strict=True)


def _shares(method: str, count: int, seed: int, key: str) -> NDArray[np.float64]:
    """Return where in its distribution each draw of a setting lies, 0 or more and below 1.

    The Latin hypercube (M. D. McKay, R. J. Beckman and W. J. Conover, Technometrics 21, 1979) has
    one draw in each of `count` parts of equal probability, the parts in random order.
    """
    if method == "random":
        return stream(seed, f"sweep over {key}").random(count)
    generator = stream(seed, f"latin hypercube over {key}")
    return (generator.permutation(count) + generator.random(count)) / count


def _label(names: Sequence[str], row: Sequence[Any]) -> str:
    return ", ".join(f"{name}={_shown(value)}" for name, value in zip(names, row, strict=True))


def _shown(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return "none" if value is None else str(value).lower()
    if isinstance(value, dict):
        return _shortened(" ".join(map(_shown, value.values())))
    if isinstance(value, list):
        return _shortened(f"[{', '.join(map(_shown, value))}]")
    return f"{value:.15g}" if isinstance(value, int | float) else str(value)


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."


def _slugs(labels: Sequence[str], numbers: Sequence[str]) -> list[str]:
    """Return the labels as names of folders, or numbers where those would be alike or long."""
    slugs = [slug_of(label) for label in labels]
    if len(set(slugs)) == len(slugs) and all(0 < len(slug) <= LONGEST_SLUG for slug in slugs):
        return slugs
    return list(numbers)
