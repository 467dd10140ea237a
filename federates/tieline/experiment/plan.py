"""Checks an experiment against its case and network, and writes out what each run will be told."""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tieline.cosim.interfaces import lead_of
from tieline.errors import InputError
from tieline.experiment.guests import check_guests
from tieline.experiment.load import Study
from tieline.experiment.schema import Experiment
from tieline.experiment.sites import Sites, Survey, Surveyor
from tieline.experiment.sweep import Gathered, Point
from tieline.network.settings import PACKET_ENGINES
from tieline.problems import near
from tieline.resources import case_folder, is_file, shipped

_GIVEN = re.compile(r" \(got [^()]*\)")
"""What points may be wrong in, each in its own way, with one sentence for all."""


@dataclass(frozen=True)
class PlannedRun:
    """One run.

    Attributes:
        point: its settings.
        run: the content of its run file.
        inputs: hashes of the files that it reads.
        interconnection: what a drawing of it needs, or None.
    """

    point: Point
    run: Mapping[str, Any]
    inputs: Mapping[str, str]
    interconnection: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Plan:
    """Every run of a study, checked and ready to start."""

    study: Study
    runs: tuple[PlannedRun, ...]


def canonical_json(data: object) -> str:
    """Return JSON that is the same text for equal data."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)


def config_hash(experiment: Experiment) -> str:
    """Return the SHA-256 of every setting of an experiment, defaults included."""
    return hashlib.sha256(canonical_json(experiment.model_dump(mode="json")).encode()).hexdigest()


def prepare(study: Study, survey: Survey | None = None) -> Plan:
    """Return the plan of a study, each of its points checked against its case and network.

    Args:
        study: a checked experiment.
        survey: checks one point, in place of a `Surveyor`; points that differ in nothing it looks
            at are checked once.

    Raises:
        InputError: every finding of every point.
    """
    findings = Gathered()
    runs: list[PlannedRun] = []
    known: dict[str, Sites] = {}
    look = Surveyor() if survey is None else survey
    for point in study.points:
        try:
            runs.append(_planned(study, point, look, known))
        except InputError as error:
            for finding in error.findings:
                text = study.located(finding, point)
                findings.add(_GIVEN.sub("", text), text, text != finding and bool(point.overrides))
    if findings.lines():
        raise InputError(findings.lines())
    return Plan(study, tuple(runs))


def _planned(study: Study, point: Point, survey: Survey, known: dict[str, Sites]) -> PlannedRun:
    beside = study.sources.document.path.parent
    experiment = _with_trace(_with_pss_file(point.experiment, beside), beside)
    folder = _case_folder(experiment.case, beside)
    topology = _topology(experiment, folder, beside)
    parts = experiment.model_dump(mode="json", include={"grid", "wams", "network"})
    key = canonical_json([str(folder), parts])
    if key not in known:
        known[key] = survey(experiment, folder, topology)
    sites = known[key]
    check_guests(experiment, sites)
    inputs = {"case": _folder_hash(folder)}
    if topology is not None:
        inputs["topology"] = hashlib.sha256(topology.read_bytes()).hexdigest()
    if experiment.grid.pss.file is not None:
        inputs["pss"] = hashlib.sha256(Path(experiment.grid.pss.file).read_bytes()).hexdigest()
    if experiment.network.empirical is not None and experiment.network.empirical.trace is not None:
        trace = Path(experiment.network.empirical.trace)
        inputs["trace"] = hashlib.sha256(trace.read_bytes()).hexdigest()
    run = _run_file(point, sites, folder, topology) | {"grid": parts["grid"]}
    run["network"]["empirical"] = parts["network"]["empirical"]
    if experiment.federation.guests:
        run["guest_directory"] = str(beside.resolve())
    return PlannedRun(point, run, inputs, sites.interconnection)


def _run_file(point: Point, sites: Sites, folder: Path, topology: Path | None) -> dict[str, Any]:
    experiment = point.experiment
    guests = experiment.federation.guests
    settings = experiment.model_dump(mode="json")
    digest = config_hash(experiment)
    return {
        "run_id": "-".join(filter(None, (experiment.name, point.slug, digest[:8]))),
        "config_hash": digest,
        "seed": experiment.seed,
        "clock": {
            "rate_hz": experiment.rate_hz,
            "intervals": experiment.intervals,
            # A guest is heard at every instant of the clock, not once a stride.
            "lead": 0 if guests else lead_of(experiment.rate_hz, sites.lookahead_ns),
        },
        "federation": settings["federation"],
        "case": str(folder),
        "grid": settings["grid"],
        "wams": settings["wams"],
        "network": settings["network"] | {"topology": None if topology is None else str(topology)},
        "sources": sites.sources(),
        "destinations": sites.destinations(),
        "frequency_hz": sites.frequency_hz,
        "tie_mode": sites.tie_mode,
        "plot_unit": sites.plot_unit,
    }


def _with_pss_file(experiment: Experiment, beside: Path) -> Experiment:
    """Return the experiment with its file of stabilisers as an absolute path.

    Raises:
        InputError: there is no such file beside the experiment's file or here.
    """
    name = experiment.grid.pss.file
    if name is None:
        return experiment
    for path in (beside / name, Path(name)):
        if is_file(path):
            pss = experiment.grid.pss.model_copy(update={"file": str(path.resolve())})
            grid = experiment.grid.model_copy(update={"pss": pss})
            return experiment.model_copy(update={"grid": grid})
    raise InputError(f"grid.pss.file {name!r} is missing: no file {beside / name}")


def _with_trace(experiment: Experiment, beside: Path) -> Experiment:
    """Return the experiment with its file of measured delays as an absolute path.

    Raises:
        InputError: there is no such file beside the experiment's file or here.
    """
    empirical = experiment.network.empirical
    if empirical is None or empirical.trace is None:
        return experiment
    for path in (beside / empirical.trace, Path(empirical.trace)):
        if is_file(path):
            found = empirical.model_copy(update={"trace": str(path.resolve())})
            network = experiment.network.model_copy(update={"empirical": found})
            return experiment.model_copy(update={"network": network})
    raise InputError(
        f"network.empirical.trace {empirical.trace!r} is missing: no file"
        f" {beside / empirical.trace}"
    )


def _case_folder(name: str, beside: Path) -> Path:
    """Return the case's folder; a path counts from the experiment's file, or else from here."""
    local = beside / name
    if is_file(local / "case.yaml"):
        return local.resolve()
    try:
        return case_folder(name)
    except InputError as error:
        known = [path.parent.name for path in shipped("cases").glob("*/case.yaml")]
        raise InputError(f"case: {error}{near(name, known)}") from error


_NOT_BY_NAME = ("case", "network")
"""Files of a case that are no further topology."""


def _topology(experiment: Experiment, folder: Path, beside: Path) -> Path | None:
    if experiment.network.engine not in PACKET_ENGINES:
        return None
    name = experiment.network.topology
    places = [beside / name, Path(name), folder / f"{name}.yaml", folder / name]
    for path in [folder / "network.yaml"] if name == "case" else places:
        if is_file(path):
            return path.resolve()
    if name == "case":
        raise InputError(
            f"network.topology of the case is missing: no file {folder / 'network.yaml'}"
        )
    own = sorted(path.stem for path in folder.glob("*.yaml") if path.stem not in _NOT_BY_NAME)
    known = f" (the case has: {', '.join(['case', *own])}{near(name, own)})"
    raise InputError(f"network.topology {name!r} is missing: no file {places[0]}{known}")


def _folder_hash(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted([*folder.glob("*.csv"), *folder.glob("*.yaml")]):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode() + content)
    return digest.hexdigest()
