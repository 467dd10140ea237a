"""Writes the manifest: what a result is, where it came from, and whether it is whole."""

import hashlib
import importlib.metadata
import json
import pathlib
import platform
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import tieline
from tieline.cosim.strangers import dropped_messages
from tieline.experiment.folder import FORMAT, MANIFEST, write_json
from tieline.experiment.launch import Outcome
from tieline.experiment.plan import Plan, PlannedRun
from tieline.experiment.sweep import Point
from tieline.experiment.table_facts import table_facts
from tieline.problems import Path, value_at

_GENERATOR = (
    "one numpy PCG64 a random thing, from SeedSequence(seed, spawn_key): the key is the SHA-256 of "
    "the stream's name as eight little-endian 32-bit words (tieline.streams)"
)
_STREAMS = "streams.json"

_PACKAGES = ("helics", "numpy", "scipy", "numba", "pandas", "pyarrow", "pydantic", "networkx")


def versions() -> dict[str, str]:
    """Return the versions of all that a result depends on."""
    return {
        "tieline": tieline.__version__,
        "python": platform.python_version(),
        **{package: _installed(package) for package in _PACKAGES},
        "platform": f"{platform.system()} {platform.machine()}",
    }


@cache
def _installed(package: str) -> str:
    """Return the version of a package; looking it up takes longer than planning a point of many."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def run_manifest(
    planned: PlannedRun, facts: Mapping[str, Any], reason: str | None
) -> dict[str, Any]:
    """Return the manifest of one run.

    Args:
        planned: the run.
        facts: as `run_facts` returns them; empty while the run is under way.
        reason: why the run is incomplete, or None when it is whole.
    """
    experiment = planned.point.experiment
    return {
        "format": FORMAT,
        "kind": "run",
        "status": "complete" if reason is None else "incomplete",
        "reason": reason,
        "name": experiment.name,
        "label": planned.point.label,
        "question": experiment.question,
        "run_id": planned.run["run_id"],
        "config": experiment.model_dump(mode="json"),
        "config_hash": planned.run["config_hash"],
        "inputs": dict(planned.inputs),
        "seed": experiment.seed,
        "random_streams": {"generator": _GENERATOR, "seed": experiment.seed},
        "clock": planned.run["clock"],
        "tripped_units": "simulated to the end behind their open branch, and in no average",
        "versions": versions(),
        **facts,
    }


def ended(base: Mapping[str, Any], facts: Mapping[str, Any], reason: str | None) -> dict[str, Any]:
    """Return the manifest of a run that has ended, from what it was when it began.

    Args:
        base: its manifest as `run_manifest` gave it.
        facts: as `run_facts` returns them.
        reason: why the run is incomplete, or None when it is whole.
    """
    status = "complete" if reason is None else "incomplete"
    return {**base, "status": status, "reason": reason, **facts}


def sweep_manifest(plan: Plan, reason: str | None) -> dict[str, Any]:
    """Return the manifest of a sweep; each of its points has one of its own."""
    runs, sources = plan.runs, plan.study.sources
    first = runs[0].point.experiment
    paths = dict.fromkeys(own.path for run in runs for own in run.point.overrides)
    points = [
        {
            "label": run.point.label,
            "slug": run.point.slug,
            "run_id": run.run["run_id"],
            "config_hash": run.run["config_hash"],
            "settings": _swept(run.point, paths),
        }
        for run in runs
    ]
    hashes = "".join(point["config_hash"] for point in points)
    return {
        "format": FORMAT,
        "kind": "sweep",
        "status": "complete" if reason is None else "incomplete",
        "reason": reason,
        "name": first.name,
        "question": first.question,
        "points": points,
        "random_streams": {"generator": _GENERATOR, **plan.study.random_streams},
        "config_hash": hashlib.sha256(hashes.encode()).hexdigest(),
        "config_file": str(sources.document.path.resolve()),
        "options": [f"{_key(given.path)}={json.dumps(given.value)}" for given in sources.options],
        "versions": versions(),
    }


def _swept(point: Point, paths: Iterable[Path]) -> dict[str, Any]:
    """Return a point's values, in SI units, of the settings that the sweep changes anywhere."""
    config = point.experiment.model_dump(mode="json")
    return {_key(path): value_at(config, path) for path in paths}


def _key(path: Path) -> str:
    """Return a path as `--set` and a sweep write it."""
    return ".".join(map(str, path))


def save_manifest(folder: pathlib.Path, manifest: Mapping[str, Any]) -> None:
    """Write a manifest into its folder."""
    write_json(folder / MANIFEST, manifest)


def random_streams(seed: int, folder: pathlib.Path) -> dict[str, Any]:
    """Return how every random stream of a run comes about, and how much of each was used.

    Only the network draws at random while a run goes on; it leaves the list in the folder.
    """
    streams = {"generator": _GENERATOR, "seed": seed}
    path = folder / _STREAMS
    if not path.is_file():
        return streams
    return streams | {"network": json.loads(path.read_text(encoding="utf-8"))}


def run_facts(outcome: Outcome | None, folder: pathlib.Path, seed: int) -> dict[str, Any]:
    """Return what a launch found out (if it got so far), `table_facts` and the random streams.

    `dropped_messages` counts, by endpoint and source, what others sent there without being asked.
    """
    facts = {
        **table_facts(folder),
        "random_streams": random_streams(seed, folder),
        "dropped_messages": dropped_messages(folder),
    }
    if outcome is None:
        return facts
    return {
        "granted_ns": outcome.granted_ns,
        "times": {
            "wall_s": sum(outcome.wall_s.values()),
            "phases_s": outcome.wall_s,
            "cpu_s": {use.name: use.cpu_s for use in outcome.processes},
        },
        "peak_memory_bytes": {use.name: use.peak_bytes for use in outcome.processes},
        **facts,
    }
