"""Looks at the result folder of a run that was harmed: is it what its manifest says?"""

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, Protocol

import pyarrow.parquet as pq

from faults.trial import Finding, Trial

GRANTED = "last granted"


class Run(Protocol):
    """A run that is over: its working folder, its target, and what it said on standard error."""

    folder: Path
    out: Path

    @property
    def said(self) -> str:
        """Return what it said."""


def look_at_result(run: Run, trial: Trial, finding: Finding) -> Iterator[str]:
    """Yield what of the result folder is not as promised; note in the finding what it says."""
    folder = run.folder / "out-incomplete"
    if trial.has_older and not (folder / "manifest.json").exists():
        folder = run.out
    elif trial.has_older:
        if read(run.out / "manifest.json").get("label") != "older":
            yield "the older result is gone"
        yield from whole(run.out, trial)
    else:
        folder = run.out
    manifest = read(folder / "manifest.json")
    finding.status = manifest.get("status", "none")
    finding.reason = manifest.get("reason") or ""
    finding.last_valid_s = manifest.get("last_valid_s")
    if finding.status == "complete":
        # The fault came when all was done, or hit nobody who had still something to do.
        is_older = manifest.get("label") == "older"
        if is_older and finding.exit_code == 0:
            yield "it said that all went well, and the older result is still there"
        yield from whole(folder, trial)
        return
    if finding.exit_code == 0:
        yield "the exit code is 0, and the result is not complete"
    yield from _words(run, trial, finding, manifest)
    yield from _incomplete(folder, trial, manifest)


def _words(run: Run, trial: Trial, finding: Finding, manifest: Any) -> Iterator[str]:
    """Yield what is wrong with what was said of a run that is not complete."""
    if not manifest:
        if trial.phase != "start":
            yield "there is no result folder"
        return
    if trial.fault.startswith("INT") or (trial.victim, trial.fault) == ("launcher", "TERM"):
        if "interrupted" not in finding.reason:
            yield f"the reason is not the interrupt: {finding.reason}"
        return
    names = {"together": ("grid", "network", "together")}.get(trial.victim, (trial.victim,))
    if trial.fault == "FULL DISK":
        names = ("grid", "network", "launcher", "together")
    if not finding.reason.startswith(names):
        yield f"{' or '.join(names)} is not named: {finding.reason}"
    if trial.phase == "running" and GRANTED not in finding.reason:
        yield f"the last granted time is not told: {finding.reason}"
    first = finding.reason.splitlines()[0] if finding.reason else "-"
    if first not in run.said:
        yield f"the user was not told '{first}': {run.said[-600:]}"


def whole(folder: Path, trial: Trial) -> Iterator[str]:
    """Yield what a complete result lacks."""
    manifest = read(folder / "manifest.json")
    if manifest.get("status") != "complete":
        yield f"{folder.name} is not complete"
    for name in ["summary.json", "run.json", *manifest.get("tables", ())]:
        if not (folder / name).is_file():
            yield f"{name} is missing in a complete result"
    yield from unreadable(folder)


def _incomplete(folder: Path, trial: Trial, manifest: Any) -> Iterator[str]:
    if manifest and "last_valid_s" not in manifest:
        yield "the manifest does not tell the last valid time"
    yield from unreadable(folder)
    streams = [path.name for path in folder.glob("*.arrows")]
    if streams and trial.fault != "FULL DISK":
        yield f"streams are left: {streams}"
    until_s = manifest.get("last_valid_s")
    grid = folder / "grid.parquet"
    if until_s is not None and grid.exists():
        t_s = pq.read_table(grid, columns=["t_s"]).column("t_s").to_pylist()
        if not t_s or t_s[-1] < until_s or any(b <= a for a, b in pairwise(t_s)):
            yield f"grid.parquet ends at {t_s[-1:]} s, the manifest says {until_s} s"
    if trial.phase == "running" and until_s is None and trial.victim != "together":
        yield "nothing is valid, though the grid had recorded"


def unreadable(folder: Path) -> Iterator[str]:
    """Yield the tables that cannot be read, in words."""
    for path in folder.rglob("*.parquet"):
        try:
            pq.read_table(path)
        except (OSError, ValueError) as error:
            yield f"{path.name} cannot be read: {error}"


def read(path: Path) -> Any:
    """Return what a JSON file holds; nothing if it is not there."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
