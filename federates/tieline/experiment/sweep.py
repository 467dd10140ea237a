"""Expands a sweep: each point is the experiment with a few settings of its own."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tieline.experiment.layers import REPLACED
from tieline.experiment.overrides import Override, Sources, apply, path_of, related
from tieline.experiment.sampling import SweepFile, rows, slug_of, streams_of
from tieline.experiment.schema import FIXED, Experiment, contradictions, without_effect
from tieline.problems import Path, checked, has_keys, near


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
        sweep: as the file has it, a list of points or a block that makes them.
        data: the experiment without its sweep.
        sources: where both come from.
    """
    if isinstance(sweep, list):
        return _listed(sweep, data, sources)
    if isinstance(sweep, dict):
        return _made(sweep, data, sources)
    where = sources.where([("sweep",)])
    return [], [f"{where}: sweep must be a list of points, or a group of keys (got {sweep!r:.60})"]


def sweep_streams(sweep: object, data: Any) -> dict[str, Any]:
    """Return the seed and the names of the random streams that a sweep's points were drawn from."""
    block, _ = checked(SweepFile, {"sweep": sweep})
    return {} if block is None else streams_of(block.sweep, _seed(data))


def _seed(data: Any) -> int:
    """Return the experiment's seed, or the default where it states none that can be."""
    seed = data.get("seed", 1) if isinstance(data, dict) else 1
    return seed if isinstance(seed, int) and seed >= 0 else 1


def judge(points: Sequence[Point], sources: Sources) -> Iterable[str]:
    """Yield what does not fit together in each point, and settings that no point reads."""
    idle = [without_effect(point.experiment) for point in points]
    sets = [{problem.paths for problem in problems} for problems in idle]
    never_read = set.intersection(*sets) if sets else set()
    findings = Gathered()
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
            findings.add((where, problem.paths, is_own), f"{where}: {of}{problem.text}", is_own)
    return findings.lines()


class Gathered:
    """Findings about points, of which those about one setting of one sweep block are told once."""

    def __init__(self) -> None:
        self._first: dict[object, str] = {}
        self._more: dict[object, int] = {}

    def add(self, about: object, finding: str, is_own: bool = True) -> None:
        """Note a finding about a setting; `is_own` when it is that of one point."""
        if about in self._first:
            self._more[about] = self._more.get(about, 0) + is_own
        self._first.setdefault(about, finding)

    def lines(self) -> list[str]:
        """Return the first finding about each setting, and how many points share it."""
        return [text + _more(self._more.get(about, 0)) for about, text in self._first.items()]


def _more(points: int) -> str:
    return f" (and in {points} more point{'s' if points > 1 else ''})" if points else ""


def _listed(sweep: Sequence[Any], data: Any, sources: Sources) -> tuple[list[Point], list[str]]:
    points: list[Point] = []
    findings: list[str] = []
    for i, entry in enumerate(sweep):
        if not isinstance(entry, dict):
            where = sources.where([("sweep", i)])
            findings.append(
                f"{where}: sweep[{i}] must be a group of keys: label, and settings"
                f" (got {entry!r:.60})"
            )
            continue
        misspelt = next((key for key in entry if "label" not in entry and _is_label(key)), "label")
        label, wrong = _label(i, entry, misspelt, sources)
        findings += wrong
        settings = {key: value for key, value in entry.items() if key not in ("label", misspelt)}
        overrides, wrong = _overrides(i, settings, sources)
        groups = _groups(overrides)
        findings += wrong + groups
        if groups:
            continue
        point, problems = _point(label, slug_of(label), overrides, data, sources)
        findings += [text for _, text in problems]
        if point is None:
            continue
        twin = next((other for other in points if other.slug == point.slug), None)
        if twin:
            where = sources.where([("sweep", i, "label")])
            findings.append(f"{where}: label '{point.label}' is taken by point '{twin.label}'")
        points.append(point)
    return points, findings


def _made(sweep: Mapping[Any, Any], data: Any, sources: Sources) -> tuple[list[Point], list[str]]:
    """Return the points of a sweep block; what is wrong with all of them is said once."""
    checked_file, problems = checked(SweepFile, {"sweep": sweep})
    if checked_file is None:
        return [], [f"{sources.where(problem.paths)}: {problem.text}" for problem in problems]
    block = checked_file.sweep
    places = {key: sources.where([("sweep", "over", key)]) for key in block.over}
    own = [Override(path_of(key), None, where) for key, where in places.items()]
    misplaced = [text for override in own for text in _misplaced(override, sources)]
    if misplaced:
        return [], misplaced
    places.setdefault("seed", sources.where([("sweep", "own_seeds")]))
    points, findings = [], Gathered()
    for row in rows(block, _seed(data)):
        overrides = [Override(path_of(key), row.settings[key], places[key]) for key in row.settings]
        groups = _groups(overrides)
        for group in groups:
            findings.add(group, group)
        if groups:
            continue
        point, found = _point(row.label, row.slug, overrides, data, sources)
        for about, text in found:
            findings.add(about, text)
        points += [] if point is None else [point]
    return points, findings.lines()


def _overrides(
    i: int, settings: Mapping[Any, Any], sources: Sources
) -> tuple[list[Override], list[str]]:
    """Return the settings of a listed point, and why some of them are out of place."""
    overrides: list[Override] = []
    findings: list[str] = []
    for key, value in settings.items():
        at: Path = ("sweep", i, key)
        override = Override(path_of(str(key)), value, sources.where([at]), at)
        wrong = _misplaced(override, sources)
        findings += wrong
        overrides += [] if wrong else [override]
    return overrides, findings


def _point(
    label: str, slug: str, overrides: Sequence[Override], data: Any, sources: Sources
) -> tuple[Point | None, list[tuple[object, str]]]:
    """Return a point, or None, and findings, each with what it is about."""
    changed, wrong = apply(data, overrides)
    findings: list[tuple[object, str]] = [(text, text) for text in wrong]
    experiment, problems = checked(Experiment, changed, sources.folder)
    for problem in problems:
        # What is wrong without the point's own settings is reported once, for the whole file.
        if _touches(overrides, problem.paths[0]):
            where = sources.where(problem.paths, overrides)
            about = (where, problem.paths)
            findings.append((about, f"{where}: point '{label}': {problem.text}"))
    if experiment is None:
        return None, findings
    return Point(label, slug, experiment, tuple(overrides)), findings


def _is_label(key: object) -> bool:
    """Return whether a key can only be a misspelt `label`."""
    return isinstance(key, str) and bool(near(key, ["label"]))


def _label(i: int, entry: dict[Any, Any], misspelt: str, sources: Sources) -> tuple[str, list[str]]:
    if misspelt != "label":
        where = sources.where([("sweep", i, misspelt)])
        unknown = f"{where}: unknown key '{misspelt}' in sweep[{i}] (did you mean 'label'?)"
        return f"point {i}", [unknown]
    label = entry.get("label")
    if isinstance(label, int | float) and not isinstance(label, bool):
        label = str(label)
    if isinstance(label, str) and slug_of(label):
        return label, []
    where = sources.where([("sweep", i, "label")])
    return f"point {i}", [f"{where}: sweep[{i}] needs a label with a letter or digit"]


def _misplaced(override: Override, sources: Sources) -> list[str]:
    if override.path[0] in FIXED:
        return [f"{override.where}: a sweep point cannot change '{override.path[0]}'"]
    key = ".".join(map(str, override.path))
    return [
        f"{option.where}: the sweep itself sets {key}; add --set sweep=[] to run without the sweep"
        for option in sources.options
        if related(option.path, override.path)
    ]


def _groups(overrides: Iterable[Override]) -> list[str]:
    """Return which settings of a listed point are whole groups, which would hide what they drop."""
    groups = [
        override
        for override in overrides
        if isinstance(override.value, dict)
        and override.path not in REPLACED
        and has_keys(Experiment, override.path)
    ]
    return [
        f"{group.where}: write one setting a key, such as"
        f" {'.'.join(map(str, group.path))}.{next(iter(group.value), '...')}"
        for group in groups
    ]


def _touches(overrides: Iterable[Override], path: Path) -> bool:
    return any(related(override.path, path) for override in overrides)
