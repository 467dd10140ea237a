"""Disturbances: what an experiment asks for, checked against the case and put on the step grid."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tieline.errors import InputError
from tieline.grid.case import Case
from tieline.grid.network import islands
from tieline.grid.settings import Event, GridSettings, TripBranch, TripGenerator
from tieline.grid.tables import near


@dataclass(frozen=True)
class Switching:
    """Branches that open at a tick, and the units that leave the interconnection with them."""

    tick: int
    branches: tuple[int, ...]
    units: tuple[int, ...]


def plan_events(case: Case, settings: GridSettings) -> list[Switching]:
    """Return the events of an experiment, in order of time.

    Raises:
        InputError: an unknown unit or branch, an instant off the step grid or after the end, a
            branch opened twice, an island without a unit.
    """
    findings: list[str] = []
    ordered = sorted(enumerate(settings.events), key=lambda item: item[1].at)
    switched: list[Switching] = []
    is_open: set[int] = set()
    for position, event in ordered:
        where = f"grid.events[{position}]"
        tick = _tick(where, event.at, settings, findings)
        rows = _branches(case, where, event, findings)
        if rows & is_open:
            name = case.branches.name[min(rows & is_open)]
            findings.append(f"{where}: branch {name} is open already")
        is_open |= rows
        findings += _dead_islands(case, where, is_open)
        units = _lone_units(case, is_open) - {
            unit for earlier in switched for unit in earlier.units
        }
        switched.append(Switching(tick, tuple(sorted(rows)), tuple(sorted(units))))
    if findings:
        raise InputError(findings)
    return switched


def _tick(where: str, at_s: float, settings: GridSettings, findings: list[str]) -> int:
    exact = at_s * settings.steps_per_second
    tick = round(exact)
    if abs(exact - tick) > 1e-6:
        nearest = tick / settings.steps_per_second
        findings.append(
            f"{where}.at: must fall on a step of 1/{settings.steps_per_second} s "
            f"(got {at_s:g} s; the nearest is {nearest:.9g} s)"
        )
    if at_s >= settings.duration:
        findings.append(
            f"{where}.at: must be before the end at {settings.duration:g} s (got {at_s:g} s)"
        )
    return tick


def _branches(case: Case, where: str, event: Event, findings: list[str]) -> set[int]:
    match event:
        case TripGenerator():
            return _step_up(case, where, event.trip_generator, findings)
        case TripBranch():
            return _named_branch(case, where, event.trip_branch, findings)


def _step_up(case: Case, where: str, unit: str, findings: list[str]) -> set[int]:
    """Return the rows of all branches at the terminal bus of a unit that has it to itself."""
    where = f"{where}.trip_generator"
    if unit not in case.units:
        findings.append(f"{where}: no unit '{unit}'{near(unit, case.units)}")
        return set()
    bus = case.unit_bus[case.units.index(unit)]
    shared = (case.unit_bus == bus).sum() > 1
    if shared or case.buses.p_load[bus] or case.buses.q_load[bus]:
        number = case.buses.number[bus]
        findings.append(f"{where}: bus {number} of '{unit}' carries other units or load")
    branches = case.branches
    return set(np.flatnonzero((branches.start == bus) | (branches.end == bus)).tolist())


def _named_branch(case: Case, where: str, name: str, findings: list[str]) -> set[int]:
    ends, _, circuit = name.partition("#")
    turned = "-".join(reversed(ends.split("-"))) + (f"#{circuit}" if circuit else "")
    for given in (name, turned):
        if given in case.branches.name:
            return {case.branches.name.index(given)}
    hint = near(name, case.branches.name)
    findings.append(f"{where}.trip_branch: no branch '{name}'{hint}")
    return set()


def _dead_islands(case: Case, where: str, is_open: set[int]) -> list[str]:
    sources = set(case.unit_bus.tolist())
    return [
        f"{where}: leaves buses {case.buses.number[island].tolist()} without a unit"
        for island in islands(case.branches, len(case.buses.number), is_open)
        if not sources & set(island.tolist())
    ]


def _lone_units(case: Case, is_open: Sequence[int] | set[int]) -> set[int]:
    """Return the units outside the largest island; they leave every average."""
    parts = islands(case.branches, len(case.buses.number), is_open)
    main = set(max(parts, key=len).tolist())
    return {unit for unit, bus in enumerate(case.unit_bus.tolist()) if bus not in main}
