"""Guests of a run: checked against its sites, and what starts each of them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tieline.cosim.conventions import guest_config
from tieline.cosim.guests import guests_of
from tieline.cosim.runfile import federation_of
from tieline.errors import InputError
from tieline.experiment.schema import Experiment
from tieline.experiment.sites import Sites
from tieline.problems import near


@dataclass(frozen=True)
class GuestProcess:
    """What starts one guest, and where it runs."""

    name: str
    command: Sequence[str]
    directory: Path


def check_guests(experiment: Experiment, sites: Sites) -> None:
    """Refuse guests whose units have no controller in this run.

    Raises:
        InputError: there is none of that name, or the average is formed without frames.
    """
    known = [unit for unit, _ in sites.controllers]
    findings = []
    for guest in experiment.federation.guests:
        findings += [
            f"federation.guests: unit '{unit}' of {guest.name} has no controller here"
            f"{near(unit, known)}"
            for unit in guest.units
            if unit not in known
        ]
        if guest.units and experiment.wams.reporting == "continuous":
            findings.append(
                f"federation.guests: {guest.name} needs frames, and wams.reporting 'continuous'"
                " sends none"
            )
    if findings:
        raise InputError(findings)


def guest_processes(run: Mapping[str, Any], folder: Path) -> list[GuestProcess]:
    """Return what starts the guests of a run file; their HELICS files go to `folder/guests`."""
    settings, place = federation_of(run)
    processes = []
    for guest in guests_of(run):
        config = guest_config(guest, run, place, settings.start_timeout)
        path = folder.resolve() / "guests" / f"{guest.name}.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(config, indent=2) + "\n", encoding="utf-8")
        words = guest.words(
            {
                "config": path,
                "name": guest.name,
                "core": place.core,
                "broker": place.host,
                "port": place.port,
                "stop": f"{config['tieline']['stop_s']}s",
                "folder": folder.resolve(),
            }
        )
        processes.append(GuestProcess(guest.name, words, Path(run["guest_directory"])))
    return processes
