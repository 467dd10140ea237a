"""Disturbances: what an experiment asks for, checked against the case and put on the step grid."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tieline.errors import InputError
from tieline.grid.case import Case, branch_name
from tieline.grid.conditions import Condition, parse_condition
from tieline.grid.event_settings import (
    BlockGovernor,
    Brake,
    CloseBranch,
    Event,
    Fault,
    ModulateHVDC,
    ScaleLoad,
    StepReference,
    TripBranch,
    TripGenerator,
)
from tieline.grid.settings import GridSettings
from tieline.grid.tables import near
from tieline.grid.topology import FAULT_SUSCEPTANCE_PU, Change

_BRANCH = re.compile(r"\s*(\d+)\s*-\s*(\d+)\s*(?:#\s*(\d{1,9})\s*)?", re.ASCII)
ON_STEP = 1e-3
"""How far from a step an instant may lie, in steps: room for times written in decimals."""


@dataclass(frozen=True)
class Stage:
    """A change, `after` ticks after its event begins."""

    after: int
    change: Change


@dataclass(frozen=True)
class Disturbance:
    """One event: where it stands, its earliest tick, what it waits for (or None), its stages."""

    where: str
    tick: int
    condition: Condition | None
    stages: tuple[Stage, ...]


def plan_events(
    case: Case, settings: GridSettings, sensors: tuple[int, ...] | None = None
) -> list[Disturbance]:
    """Return the events of an experiment, in order of time.

    Args:
        case: the interconnection.
        settings: with the events.
        sensors: bus numbers with a PMU, for conditions; the case's own by default.

    Raises:
        InputError: unknown units, buses or branches, instants off the step grid or after the end,
            events that contradict each other; every finding.
    """
    planner = _Planner(case, settings, case.base.sensors if sensors is None else sensors)
    ordered = sorted(enumerate(settings.events), key=lambda item: item[1].at)
    planned = [planner.plan(f"grid.events[{i}]", event) for i, event in ordered]
    planner.check_branches(planned)
    if planner.findings:
        raise InputError(planner.findings)
    return planned


class _Planner:
    """Turns events into stages and collects what is wrong with them."""

    def __init__(self, case: Case, settings: GridSettings, sensors: tuple[int, ...]) -> None:
        self.findings: list[str] = []
        self._case = case
        self._settings = settings
        self._sensors = sensors

    def plan(self, where: str, event: Event) -> Disturbance:
        """Return an event's disturbance."""
        tick = self._tick(f"{where}.at", event.at)
        if event.at >= self._settings.duration:
            self.findings.append(
                f"{where}.at: must be before the end at {self._settings.duration:g} s "
                f"(got {event.at:g} s)"
            )
        condition = None
        if event.when is not None:
            try:
                condition = parse_condition(
                    event.when, self._case, self._sensors, self._settings.steps_per_second
                )
            except ValueError as error:
                self.findings.append(f"{where}.when: {error}")
        return Disturbance(where, tick, condition, tuple(self._stages(where, event)))

    def check_branches(self, planned: list[Disturbance]) -> None:
        """Find branches that are opened while open or closed while closed, by time."""
        is_open: set[int] = set()
        timed = [
            (item.tick + stage.after, item.where, stage.change)
            for item in planned
            if item.condition is None
            for stage in item.stages
        ]
        for _, where, change in sorted(timed, key=lambda entry: entry[0]):
            for row in sorted(change.opens & is_open):
                name = self._case.branches.name[row]
                self.findings.append(f"{where}: branch {name} is open already")
            for row in sorted(change.closes - is_open):
                name = self._case.branches.name[row]
                self.findings.append(f"{where}: branch {name} is closed already")
            is_open = (is_open | change.opens) - change.closes

    def _stages(self, where: str, event: Event) -> Iterator[Stage]:
        match event:
            case TripGenerator():
                rows = self._step_up(f"{where}.trip_generator", event.trip_generator)
                yield Stage(0, Change(f"{event.trip_generator} trips", opens=rows))
            case TripBranch():
                rows = self._branch(f"{where}.trip_branch", event.trip_branch)
                yield Stage(0, Change(f"branch {event.trip_branch} opens", opens=rows))
                if event.reclose_after is not None:
                    after = self._tick(f"{where}.reclose_after", event.reclose_after)
                    yield Stage(after, Change(f"branch {event.trip_branch} closes", closes=rows))
            case CloseBranch():
                rows = self._branch(f"{where}.close_branch", event.close_branch)
                yield Stage(0, Change(f"branch {event.close_branch} closes", closes=rows))
            case Fault():
                yield from self._fault(where, event)
            case Brake():
                bus = self._bus(f"{where}.brake_bus", event.brake_bus)
                after = self._tick(f"{where}.duration", event.duration)
                size = event.size_MW / self._case.base.base_MVA
                name = f"brake {where}"
                on = {name: (bus, complex(size))}
                yield Stage(0, Change(f"brake at bus {event.brake_bus} on", shunts=on))
                off = f"brake at bus {event.brake_bus} off"
                yield Stage(after, Change(off, shunts={name: None}))
            case ScaleLoad():
                yield Stage(0, self._scale(where, event))
            case StepReference():
                yield Stage(0, self._step(where, event))
            case ModulateHVDC():
                bus = self._bus(f"{where}.modulate_hvdc", event.modulate_hvdc)
                if bus not in self._case.loads.bus:
                    self.findings.append(
                        f"{where}.modulate_hvdc: bus {event.modulate_hvdc} has no constant-current "
                        "terminal in load.csv"
                    )
                power = event.power_MW / self._case.base.base_MVA
                text = f"HVDC terminal at bus {event.modulate_hvdc}: {event.power_MW:+g} MW"
                yield Stage(0, Change(text, extra_load={bus: power}))
            case BlockGovernor():
                yield Stage(0, self._block(where, event))

    def _fault(self, where: str, event: Fault) -> Iterator[Stage]:
        """Yield the fault, its clearing at the bus and at the far end of the branch.

        Between the two the far bus feeds the fault through the branch, whose near half of the
        charging is at the fault: Y = jb/2 + 1 / (z + 1 / (jb/2 + y_fault)).
        """
        bus = self._bus(f"{where}.fault_bus", event.fault_bus)
        near_name, far_name = f"fault {where}", f"far fault {where}"
        bolted = complex(0.0, -FAULT_SUSCEPTANCE_PU)
        near_end = self._tick(f"{where}.clear_after", event.clear_after)
        on = {near_name: (bus, bolted)}
        yield Stage(0, Change(f"fault at bus {event.fault_bus}", shunts=on))
        if event.trip is None:
            if event.far_clear_after is not None:
                self.findings.append(
                    f"{where}.far_clear_after: needs `trip`, the branch that opens"
                )
            cleared = f"fault at bus {event.fault_bus} cleared"
            yield Stage(near_end, Change(cleared, shunts={near_name: None}))
            return
        rows = self._branch(f"{where}.trip", event.trip)
        for row in rows:
            if bus not in (self._case.branches.start[row], self._case.branches.end[row]):
                self.findings.append(
                    f"{where}.trip: branch {event.trip} does not end at bus {event.fault_bus}"
                )
        opened = f"branch {event.trip} opens at bus {event.fault_bus}"
        if event.far_clear_after is None:
            yield Stage(near_end, Change(opened, opens=rows, shunts={near_name: None}))
            return
        far_end = self._tick(f"{where}.far_clear_after", event.far_clear_after)
        if far_end <= near_end:
            self.findings.append(
                f"{where}.far_clear_after: must be after clear_after {event.clear_after:g} s "
                f"(got {event.far_clear_after:g} s)"
            )
        for row in rows:
            start, end = self._case.branches.start[row], self._case.branches.end[row]
            if self._case.branches.tap[row] != 1.0:
                self.findings.append(f"{where}.trip: branch {event.trip} has a tap or phase shift")
            half = 0.5j * self._case.branches.susceptance[row]
            through = 1.0 / (self._case.branches.impedance[row] + 1.0 / (half + bolted))
            far = int(end if start == bus else start)
            stub = {near_name: None, far_name: (far, complex(half + through))}
            yield Stage(near_end, Change(opened, opens=rows, shunts=stub))
        gone = f"branch {event.trip} opens at its far end"
        yield Stage(far_end, Change(gone, shunts={far_name: None}))

    def _scale(self, where: str, event: ScaleLoad) -> Change:
        buses, given = self._case.buses, event.scale_load
        loaded = np.flatnonzero((buses.p_load != 0) | (buses.q_load != 0)).tolist()
        if given == "all":
            rows = loaded
        else:
            numbers = given if isinstance(given, list) else [given]
            rows = [self._bus(f"{where}.scale_load", number) for number in numbers]
        for row in rows:
            if row not in loaded:
                self.findings.append(f"{where}.scale_load: bus {buses.number[row]} has no load")
        text = f"load at {given if given == 'all' else f'bus {given}'} times {event.factor:g}"
        return Change(text, load_factor=dict.fromkeys(rows, event.factor))

    def _step(self, where: str, event: StepReference) -> Change:
        unit = self._unit(f"{where}.step_reference", event.step_reference)
        steps = (("Vref", "exciter", event.Vref), ("Pref", "governor", event.Pref))
        if not event.Vref and not event.Pref:
            self.findings.append(f"{where}: needs Vref or Pref, the change of a set-point")
        for name, role, size in steps:
            if size and self._case.device(role, event.step_reference) is None:
                self.findings.append(f"{where}.{name}: '{event.step_reference}' has no {role}")
        references = tuple((name, unit, size) for name, _, size in steps if size)
        return Change(f"set-point of {event.step_reference} steps", references=references)

    def _block(self, where: str, event: BlockGovernor) -> Change:
        given = event.block_governor
        governed = [device.unit for device in self._case.devices["governor"]]
        names = governed if given == "all" else given if isinstance(given, list) else [given]
        for name in names:
            if name not in governed:
                hint = near(name, governed)
                self.findings.append(f"{where}.block_governor: no governor of '{name}'{hint}")
        rows = frozenset(self._case.units.index(name) for name in names if name in governed)
        return Change(f"governor of {', '.join(names)} blocked", blocked=rows)

    def _tick(self, where: str, time_s: float) -> int:
        rate = self._settings.steps_per_second
        tick = round(time_s * rate)
        if abs(time_s * rate - tick) > ON_STEP:
            self.findings.append(
                f"{where}: must fall on a step of 1/{rate} s "
                f"(got {time_s:g} s; the nearest is {tick / rate:.9g} s)"
            )
        return tick

    def _unit(self, where: str, name: str) -> int:
        if name not in self._case.units:
            self.findings.append(f"{where}: no unit '{name}'{near(name, self._case.units)}")
            return 0
        return self._case.units.index(name)

    def _bus(self, where: str, number: int) -> int:
        numbers = self._case.buses.number
        if number not in numbers:
            hint = near(str(number), [str(known) for known in numbers])
            self.findings.append(f"{where}: no bus {number}{hint}")
            return 0
        return self._case.bus_index(number)

    def _step_up(self, where: str, name: str) -> frozenset[int]:
        """Return the rows of all branches at the terminal bus of a unit that has it to itself."""
        case = self._case
        if name not in case.units:
            self._unit(where, name)
            return frozenset()
        bus = case.unit_bus[case.units.index(name)]
        shared = (case.unit_bus == bus).sum() > 1
        if shared or case.buses.p_load[bus] or case.buses.q_load[bus]:
            self.findings.append(
                f"{where}: '{name}' shares bus {case.buses.number[bus]} with other units or load, "
                "so that no branch can take it out alone; give a unit with a bus of its own, or "
                "use trip_branch"
            )
        rows = (case.branches.start == bus) | (case.branches.end == bus)
        return frozenset(np.flatnonzero(rows).tolist())

    def _branch(self, where: str, name: str) -> frozenset[int]:
        """Return the row of the branch of this name, written from either end."""
        names = self._case.branches.name
        match = _BRANCH.fullmatch(name)
        if match is not None:
            start, end, circuit = match.groups()
            for ends in ((start, end), (end, start)):
                given = branch_name(*ends, int(circuit or 1))
                if given in names:
                    return frozenset({names.index(given)})
        self.findings.append(f"{where}: no branch '{name}'{near(name, names)}")
        return frozenset()
