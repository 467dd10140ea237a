"""Reads an experiment whole: files, `--set` options and sweep; every finding in one message."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tieline.errors import InputError
from tieline.experiment.layers import (
    EXTENDS,
    find_experiment,
    read_layers,
    shipped_experiments,
    shortest,
)
from tieline.experiment.overrides import Sources, apply, parse_settings, path_of
from tieline.experiment.schema import Experiment
from tieline.experiment.sweep import Point, expand, judge, sweep_streams
from tieline.problems import checked

__all__ = ["Study", "find_experiment", "load_experiment", "shipped_experiments"]

_SETTING = re.compile(r"((?:grid|wams|network|case)(?:\.\w+|\[\d+\])*)(?=[\s:])")


@dataclass(frozen=True)
class Study:
    """An experiment as it will be run: one point, or the points of its sweep.

    Attributes:
        sources: the files and the options that it came from.
        points: the runs, in order; at least one.
        is_sweep: whether it asks for a sweep, of however many points.
        base: the experiment without its sweep, as the files and options have it.
        random_streams: seed and names of the streams that the sweep's points were drawn from.
    """

    sources: Sources
    points: tuple[Point, ...]
    is_sweep: bool
    base: Experiment
    random_streams: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The experiment's name."""
        return self.base.name

    @property
    def question(self) -> str:
        """The question it answers."""
        return self.base.question

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


def load_experiment(reference: str, settings: Sequence[str] = ()) -> Study:
    """Return a study whose every point has been checked, apart from the case that it names.

    Args:
        reference: path of a YAML file, or the name of a shipped experiment.
        settings: `key=value` options to put over it.

    Raises:
        InputError: anything is wrong with files, options or sweep; all findings at once.
    """
    layers = read_layers(Path(shortest(find_experiment(reference))))
    options, findings = parse_settings(settings)
    for option in options:
        if option.path[0] == EXTENDS:
            findings.append(f"{option.where}: only a file can say 'extends'")
    options = [option for option in options if option.path[0] != EXTENDS]
    sources = Sources(layers, tuple(options))
    data, wrong = apply(layers.data, options)
    sweep = data.pop("sweep", None) if isinstance(data, dict) else None
    experiment, problems = checked(Experiment, data, sources.folder)
    findings += wrong
    findings += [f"{sources.where(problem.paths)}: {problem.text}" for problem in problems]
    points = [] if experiment is None else [Point("", "", experiment)]
    if sweep not in (None, []):
        points, wrong = expand(sweep, data, sources)
        findings += wrong
    findings += judge(points, sources)
    if findings:
        raise InputError(sorted(dict.fromkeys(findings), key=_line))
    assert experiment is not None
    drawn = sweep_streams(sweep, data) if isinstance(sweep, dict) else {}
    return Study(sources, tuple(points), bool(sweep), experiment, drawn)


def _line(finding: str) -> tuple[str, int]:
    """Return the file and line that a finding names, so that they stand in their order."""
    match = re.match(r"([^:]*):(\d+):", finding)
    return (match.group(1), int(match.group(2))) if match else ("", 0)
