"""Finds the runs that a word on the command line means."""

from collections.abc import Sequence
from pathlib import Path

from tieline.errors import InputError
from tieline.experiment.results import POINTS, Run, is_result, read_manifest, read_runs
from tieline.problems import near


def runs_of(references: Sequence[str]) -> list[Run]:
    """Return the complete runs that some references mean, in order, each once.

    Raises:
        InputError: a reference means nothing, or no complete run.
    """
    found: dict[Path, Run] = {}
    for reference in references:
        for run in _runs(reference):
            found.setdefault(run.folder.resolve(), run)
    return list(found.values())


def _runs(reference: str) -> list[Run]:
    """Return the runs of a run's folder, a sweep's (all of them), or `FOLDER:LABEL` (one)."""
    if is_result(Path(reference)):
        runs = read_runs(Path(reference))
        complete = [run for run in runs if run.is_complete]
        if not complete:
            reason = read_manifest(Path(reference))["reason"]
            raise InputError(f"{reference} holds no complete run ({reason})")
        return complete
    folder, colon, label = reference.rpartition(":")
    if colon and is_result(Path(folder)):
        return [_point(Path(folder), label)]
    raise InputError(
        f"{reference} is no result: give the folder of a run or a sweep, FOLDER/{POINTS}/NAME or"
        " FOLDER:LABEL"
    )


def _point(folder: Path, label: str) -> Run:
    runs = read_runs(folder)
    for run in runs:
        if label in (run.label, run.folder.name):
            if run.is_complete:
                return run
            raise InputError(f"{folder}:{label} is incomplete ({run.manifest['reason']})")
    labels = [run.label for run in runs]
    raise InputError(
        f"{folder} has no point '{label}'{near(label, labels)} (it has: {', '.join(labels)})"
    )


def named(runs: Sequence[Run]) -> list[str]:
    """Return a name for each run: its label, and its folder where labels alone are not enough."""
    labels = [run.label for run in runs]
    folders = [_home(run).name for run in runs]
    if len(set(folders)) == 1 and len(set(labels)) == len(labels):
        return labels
    if len(set(folders)) == len(folders):
        return [
            folder if label == run.manifest["name"] else f"{folder}:{label}"
            for run, folder, label in zip(runs, folders, labels, strict=True)
        ]
    return [f"{folder}:{label}" for folder, label in zip(folders, labels, strict=True)]


def _home(run: Run) -> Path:
    """Return the folder of the sweep that a run belongs to, or its own."""
    parent = run.folder.resolve().parent
    return parent.parent if parent.name == POINTS else run.folder.resolve()
