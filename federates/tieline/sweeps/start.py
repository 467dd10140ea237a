"""Decides how the points of a sweep are run: over what, how many at once, and from where."""

from dataclasses import replace
from pathlib import Path

from tieline.errors import InputError
from tieline.experiment.load import Study, load_experiment
from tieline.experiment.overrides import related
from tieline.experiment.plan import Plan
from tieline.experiment.results import read_manifest
from tieline.experiment.sweep import Point
from tieline.experiment.sweep_run import Runner
from tieline.sweeps.local import LocalPool, default_jobs

ONE_PROCESS = "local"
"""The core of a sweep for which none was chosen. It needs some 0.8 s of processor time for a point
of one simulated second where zmq needs 1.5, and every core gives the same bits."""

_CORE = ("federation", "core")


def with_core(study: Study) -> Study:
    """Return a sweep with one process a point, unless file, option or sweep chooses the core."""
    first = study.points[0].experiment
    is_chosen = "core" in first.federation.model_fields_set or any(
        related(own.path, _CORE) for point in study.points for own in point.overrides
    )
    if is_chosen or not study.is_sweep:
        return study
    return replace(study, points=tuple(_in_one_process(point) for point in study.points))


def runner_of(plan: Plan, jobs: int | None = None, scheduler: str | None = None) -> Runner:
    """Return what runs the points of a plan.

    Args:
        plan: the sweep.
        jobs: points at once on this machine; None for as many as suit it.
        scheduler: address of a Dask scheduler whose workers run them instead, or None.

    Raises:
        InputError: the number is below 1, both are given, or Dask is not installed.
    """
    core = plan.runs[0].point.experiment.federation.core
    if scheduler is None:
        if jobs is not None and jobs < 1:
            raise InputError(f"--jobs must be at least 1 (got {jobs})")
        return LocalPool(jobs or default_jobs(plan), core)
    if jobs is not None:
        raise InputError("--jobs is for this machine: the workers of --scheduler set their own")
    try:
        from tieline.sweeps.cluster import DaskCluster
    except ModuleNotFoundError as error:
        raise InputError(
            "--scheduler needs Dask: install it with pip install 'tieline[dask]'"
        ) from error
    return DaskCluster(scheduler, core)


def resumed(folder: Path) -> tuple[str, list[str]]:
    """Return the experiment's file and the `--set` options that a sweep's folder was made with.

    Raises:
        InputError: the folder is no sweep.
    """
    manifest = read_manifest(folder)
    if manifest["kind"] != "sweep":
        raise InputError(f"--resume {folder} is a single run: only a sweep can be resumed")
    return manifest["config_file"], list(manifest["options"])


def load_sweep(reference: str, settings: list[str]) -> Study:
    """Return a checked sweep, each of its points in one process unless a core is chosen.

    Raises:
        InputError: anything is wrong with it, or it has no sweep.
    """
    study = load_experiment(reference, settings)
    if not study.is_sweep:
        raise InputError(
            f"{study.sources.document.path} has no sweep: add `sweep:`, or use `tieline run`"
        )
    return with_core(study)


def _in_one_process(point: Point) -> Point:
    federation = point.experiment.federation.model_copy(update={"core": ONE_PROCESS})
    return replace(point, experiment=point.experiment.model_copy(update={"federation": federation}))
