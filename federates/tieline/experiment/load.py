"""Reads an experiment whole: file, `--set` options and sweep; every finding in one message."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tieline import yaml_lines
from tieline.errors import InputError
from tieline.experiment.overrides import Sources, apply, parse_settings, path_of, shortest
from tieline.experiment.schema import Experiment
from tieline.experiment.sweep import Point, expand, judge
from tieline.problems import checked, near
from tieline.resources import shipped

_SETTING = re.compile(r"((?:grid|wams|network|case)(?:\.\w+|\[\d+\])*)(?=[\s:])")


@dataclass(frozen=True)
class Study:
    """An experiment as it will be run: one point, or the points of its sweep.

    Attributes:
        sources: the file and the options that it came from.
        points: the runs, in order; at least one.
        is_sweep: whether it asks for a sweep, of however many points.
    """

    sources: Sources
    points: tuple[Point, ...]
    is_sweep: bool

    @property
    def name(self) -> str:
        """The experiment's name."""
        return self.points[0].experiment.name

    @property
    def question(self) -> str:
        """The question it answers."""
        return self.points[0].experiment.question

    def located(self, finding: str, point: Point) -> str:
        """Return a finding about a point with the place that it speaks of in front.

        A finding that begins with a setting (`grid.events[0].trip_generator ...`) gets that
        setting's file and line; any other already says where it belongs.
        """
        match = _SETTING.match(finding)
        if match is None:
            return finding
        path = path_of(re.sub(r"\[(\d+)\]", r".\1", match.group(1)))
        return f"{self.sources.where([path], point.overrides)}: {finding}"


def find_experiment(reference: str) -> Path:
    """Return the file of an experiment given by its path or by a shipped name.

    Raises:
        InputError: there is no such file; the message lists the shipped experiments.
    """
    path = Path(reference)
    if path.is_file():
        return path
    by_name = shipped("configs") / f"{reference}.yaml"
    if re.fullmatch(r"[\w-]+", reference) and by_name.is_file():
        return by_name
    names = [path.stem for path in shipped_experiments()]
    raise InputError(
        f"no experiment '{reference}'{near(reference, names)} (shipped: {', '.join(names)};"
        " or give the path of a YAML file)"
    )


def shipped_experiments() -> list[Path]:
    """Return the files of the shipped experiments, in order of their names."""
    return sorted(shipped("configs").glob("*.yaml"))


def load_experiment(reference: str, settings: Sequence[str] = ()) -> Study:
    """Return a study whose every point has been checked, apart from the case that it names.

    Args:
        reference: path of a YAML file, or the name of a shipped experiment.
        settings: `key=value` options to put over it.

    Raises:
        InputError: anything is wrong with file, options or sweep; all findings at once.
    """
    document = yaml_lines.load(Path(shortest(find_experiment(reference))))
    options, findings = parse_settings(settings)
    sources = Sources(document, tuple(options))
    data, wrong = apply({} if document.data is None else document.data, options)
    sweep = data.pop("sweep", None) if isinstance(data, dict) else None
    experiment, problems = checked(Experiment, data)
    findings += wrong
    findings += [f"{sources.where(problem.paths)}: {problem.text}" for problem in problems]
    points = [] if experiment is None else [Point("", "", experiment)]
    if sweep not in (None, []):
        points, wrong = expand(sweep, data, sources)
        findings += wrong
    findings += judge(points, sources)
    if findings:
        raise InputError(sorted(dict.fromkeys(findings), key=_line))
    return Study(sources, tuple(points), bool(sweep))


def _line(finding: str) -> int:
    """Return the line that a finding names, so that they stand in the file's order."""
    match = re.match(r"[^:]*:(\d+):", finding)
    return int(match.group(1)) if match else 0
