"""Expands a sweep: each point is the experiment with a few settings of its own."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tieline.experiment.overrides import Override, Sources, apply, path_of, related
from tieline.experiment.schema import FIXED, Experiment, contradictions, without_effect
from tieline.problems import Path, checked


@dataclass(frozen=True)
class Point:
    """One run of an experiment.

    Attributes:
        label: as the sweep names it; empty without a sweep.
        slug: the name of its folder.
        experiment: every setting, checked.
        overrides: what the sweep changed.
    """

    label: str
    slug: str
    experiment: Experiment
    overrides: tuple[Override, ...] = ()


def expand(sweep: object, data: Any, sources: Sources) -> tuple[list[Point], list[str]]:
    """Return the sound points of a sweep, and what is wrong with it or with the others.

    Args:
        sweep: as the file has it.
        data: the experiment without its sweep.
        sources: where both come from.
    """
    if not isinstance(sweep, list):
        return [], [
            f"{sources.where([('sweep',)])}: sweep must be a list of points (got {sweep!r})"
        ]
    points: list[Point] = []
    findings: list[str] = []
    for i, entry in enumerate(sweep):
        point, wrong = _point(i, entry, data, sources)
        findings += wrong
        if point is None:
            continue
        twin = next((other for other in points if other.slug == point.slug), None)
        if twin:
            where = sources.where([("sweep", i, "label")])
            findings.append(f"{where}: label '{point.label}' is taken by point '{twin.label}'")
        points.append(point)
    return points, findings


def judge(points: Sequence[Point], sources: Sources) -> Iterable[str]:
    """Yield what does not fit together in each point, and settings that no point reads."""
    idle = [without_effect(point.experiment) for point in points]
    sets = [{problem.paths for problem in problems} for problems in idle]
    never_read = set.intersection(*sets) if sets else set()
    for point, unread in zip(points, idle, strict=True):
        own = [
            problem
            for problem in unread
            if problem.paths in never_read or _touches(point.overrides, problem.paths[0])
        ]
        for problem in [*contradictions(point.experiment), *own]:
            where = sources.where(problem.paths, point.overrides)
            is_own = any(_touches(point.overrides, path) for path in problem.paths)
            # What the point's own settings have no part in is the same for all, and said once.
            of = f"point '{point.label}': " if is_own else ""
            yield f"{where}: {of}{problem.text}"


def _point(i: int, entry: Any, data: Any, sources: Sources) -> tuple[Point | None, list[str]]:
    if not isinstance(entry, dict):
        where = sources.where([("sweep", i)])
        return None, [f"{where}: sweep[{i}] must be a group of keys: label, and settings"]
    label, findings = _label(i, entry, sources)
    overrides = []
    for key, value in entry.items():
        if key == "label":
            continue
        override = Override(path_of(str(key)), value, sources.where([("sweep", i, key)]))
        wrong = _misplaced(str(key), override, label, sources)
        findings += wrong
        overrides += [] if wrong else [override]
    changed, wrong = apply(data, overrides)
    findings += wrong
    experiment, problems = checked(Experiment, changed)
    for problem in problems:
        # What is wrong without the point's own settings is reported once, for the whole file.
        if _touches(overrides, problem.paths[0]):
            where = sources.where(problem.paths, overrides)
            findings.append(f"{where}: point '{label}': {problem.text}")
    if experiment is None:
        return None, findings
    return Point(label, _slug(label), experiment, tuple(overrides)), findings


def _label(i: int, entry: dict[Any, Any], sources: Sources) -> tuple[str, list[str]]:
    label = entry.get("label")
    if isinstance(label, int | float) and not isinstance(label, bool):
        label = str(label)
    if isinstance(label, str) and _slug(label):
        return label, []
    where = sources.where([("sweep", i, "label")])
    return f"point {i}", [f"{where}: sweep[{i}] needs a label with a letter or digit"]


def _misplaced(key: str, override: Override, label: str, sources: Sources) -> list[str]:
    path, where = override.path, override.where
    if path[0] in FIXED:
        return [f"{where}: a sweep point cannot change '{path[0]}'"]
    if isinstance(override.value, dict):
        inner = next(iter(override.value), "...")
        return [f"{where}: write one setting a key, such as {key}.{inner}"]
    return [
        f"{option.where}: the sweep itself sets {key}; add --set sweep=[] to run without the sweep"
        for option in sources.options
        if related(option.path, path)
    ]


def _touches(overrides: Iterable[Override], path: Path) -> bool:
    return any(related(override.path, path) for override in overrides)


def _slug(label: str) -> str:
    return re.sub(r"[^a-z0-9.]+", "-", label.lower()).strip("-.")
