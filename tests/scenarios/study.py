"""Runs an experiment the way the command line does."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tieline.experiment.launch import Outcome, launch
from tieline.experiment.load import load_experiment
from tieline.experiment.plan import prepare
from tieline.experiment.results import Run, read_runs
from tieline.experiment.run import execute


def run(
    reference: str,
    target: Path,
    *settings: str,
    launch: Callable[..., Outcome] = launch,
    **how: Any,
) -> Run:
    """Return the result of an experiment with settings, started as `how` says."""
    plan = prepare(load_experiment(reference, list(settings)))
    execute(plan, target, lambda folder, report: launch(folder, report, **how))
    return read_runs(target)[0]
