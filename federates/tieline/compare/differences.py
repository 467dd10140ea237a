"""What differs between runs: each figure against the first run's, and each setting."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tieline.experiment.results import Run


@dataclass(frozen=True)
class Figure:
    """One figure of a summary.

    Attributes:
        name: as the table shows it, with the unit it is shown in.
        path: group and name in the summary.
        scale: from the summary's unit to the one shown.
        decimals: shown after the point.
    """

    name: str
    path: tuple[str, str]
    scale: float = 1.0
    decimals: int = 3

    def of(self, summary: Mapping[str, Any]) -> float | None:
        """Return the figure in the unit shown, or None where the run has none."""
        group = summary.get(self.path[0])
        value = group.get(self.path[1]) if isinstance(group, Mapping) else None
        return None if value is None else self.scale * float(value)


FIGURES = (
    Figure("delay, mean, ms", ("delay", "mean_s"), 1e3, 1),
    Figure("delay, 95 % within, ms", ("delay", "p95_s"), 1e3, 1),
    Figure("jitter, ms", ("delay", "jitter_s"), 1e3, 2),
    Figure("loss, %", ("packets", "loss"), 1e2, 2),
    Figure("age of data, mean, ms", ("age", "mean_s"), 1e3, 1),
    Figure("frequency nadir, Hz", ("frequency", "nadir_hz")),
    Figure("nadir at, s", ("frequency", "nadir_s"), decimals=2),
    Figure("frequency settles at, Hz", ("frequency", "settling_hz")),
    Figure("swing, Hz", ("swing", "frequency_hz")),
    Figure("swing, damping ratio", ("swing", "damping_ratio")),
    Figure("lowest voltage, pu", ("lowest_voltage", "vt_pu")),
)


@dataclass(frozen=True)
class Row:
    """One figure of some runs.

    Attributes:
        figure: which.
        values: one a run, in the unit shown; None where a run has none.
    """

    figure: Figure
    values: tuple[float | None, ...]

    def difference(self, i: int) -> float | None:
        """Return how far run `i` is from the first one; None if either has no value."""
        first, value = self.values[0], self.values[i]
        return None if first is None or value is None else value - first


def figures_of(runs: Sequence[Run]) -> list[Row]:
    """Return the figures that at least one of some runs has."""
    summaries = [run.summary() for run in runs]
    rows = [Row(figure, tuple(figure.of(summary) for summary in summaries)) for figure in FIGURES]
    return [row for row in rows if any(value is not None for value in row.values)]


def settings_that_differ(runs: Sequence[Run]) -> dict[str, list[Any]]:
    """Return every setting, input or version in which some runs differ, with one value a run."""
    flat = [_flat(run) for run in runs]
    keys = dict.fromkeys(key for facts in flat for key in facts)
    table = {key: [facts.get(key) for facts in flat] for key in keys}
    return {key: values for key, values in table.items() if any(v != values[0] for v in values)}


def _flat(run: Run) -> dict[str, Any]:
    facts: dict[str, Any] = {}
    _gather(run.config, "", facts, lambda key: key not in ("name", "question"))
    for name, digest in run.manifest["inputs"].items():
        facts[f"content of the {name}"] = digest[:12]
    facts["version of tieline"] = run.manifest["versions"]["tieline"]
    return facts


def _gather(
    group: Mapping[str, Any], before: str, facts: dict[str, Any], takes: Callable[[str], bool]
) -> None:
    for key, value in group.items():
        if isinstance(value, Mapping):
            _gather(value, f"{before}{key}.", facts, takes)
        elif before or takes(key):
            facts[f"{before}{key}"] = value
