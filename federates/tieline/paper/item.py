"""An item: one thing that the paper shows, what is computed for it, and what it states about it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from matplotlib.figure import Figure

from tieline.experiment.results import Run
from tieline.paper.statement import Statement


@dataclass(frozen=True)
class Spec:
    """A run of the federation.

    Attributes:
        experiment: name of a shipped experiment.
        settings: `key=value` options over it.
    """

    experiment: str
    settings: tuple[str, ...] = ()


class Work(Protocol):
    """What an item may use."""

    @property
    def quick(self) -> bool:
        """Whether fewer points and shorter runs are asked for."""

    def run(self, spec: Spec) -> Run:
        """Return the result of a run, waiting for its end."""


@dataclass(frozen=True)
class Drawn:
    """A figure and what a reader is to see in it."""

    figure: Figure
    caption: str


@dataclass(frozen=True)
class Found:
    """What an item computed: numbers by name, for its statements and their reasons, and figures."""

    numbers: Mapping[str, float]
    figures: Mapping[str, Drawn] = field(default_factory=dict)


def no_runs(quick: bool) -> tuple[Spec, ...]:
    """Return that an item needs no run of the federation."""
    return ()


@dataclass(frozen=True)
class Item:
    """One figure or table of the paper.

    Attributes:
        id: what `--only` calls it.
        title: what it shows.
        shows: what the paper's figure or table shows, by content.
        computed: what is computed here, in a sentence.
        statements: what the paper says about it.
        compute: gives numbers and figures.
        runs: the runs that `compute` will ask for, so that they can be started early.
    """

    id: str
    title: str
    shows: str
    computed: str
    statements: tuple[Statement, ...]
    compute: Callable[[Work], Found]
    runs: Callable[[bool], tuple[Spec, ...]] = no_runs
