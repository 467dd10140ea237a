"""Everything about the grid's part of an experiment that can be refused before a process starts."""

from collections.abc import Callable
from dataclasses import dataclass

from tieline.errors import InputError, TielineError
from tieline.grid.average import rotor_weights, sensor_weights
from tieline.grid.case import Case
from tieline.grid.devices import groups, with_pss
from tieline.grid.events import plan_events
from tieline.grid.initialise import initial_states
from tieline.grid.load_mix import with_load_mix
from tieline.grid.network import islands
from tieline.grid.powerflow import solve_power_flow
from tieline.grid.settings import GridSettings
from tieline.grid.tables import near
from tieline.wams.settings import WamsSettings


@dataclass(frozen=True)
class Sites:
    """Where PMUs and controllers stand.

    Attributes:
        sensors: bus number of each PMU.
        controllers: unit and bus number of each stabiliser in service.
    """

    sensors: tuple[int, ...]
    controllers: tuple[tuple[str, int], ...]


def check(case: Case, grid: GridSettings, wams: WamsSettings) -> Sites:
    """Return the sites of an experiment on a case, after trying all that needs no integration.

    Raises:
        InputError: unknown units, buses or branches, events that cannot happen, stabilisers that
            cannot act, a network in parts, a power flow that diverges, limits violated at the
            start; every finding.
    """
    findings = [*_unknown_sensors(case, wams), *_unmeasured_average(grid, wams)]

    def attempt(part: Callable[[], Case | None]) -> Case | None:
        try:
            return part()
        except InputError as error:
            findings.extend(error.findings)
        except TielineError as error:
            findings.append(str(error))
        return None

    if not findings:
        attempt(lambda: _weigh(case, grid, wams))
    fitted = attempt(lambda: with_pss(with_load_mix(case, grid.loads), grid.pss))
    parts = _parts(case)
    if parts:
        findings += parts
    else:
        attempt(lambda: _settle(fitted or case))
        attempt(lambda: _plan(case, grid, sensor_buses(case, wams)))
    if findings:
        raise InputError(findings)
    assert fitted is not None
    return Sites(sensor_buses(case, wams), controllers(fitted))


def _settle(case: Case) -> None:
    initial_states(case, solve_power_flow(case), groups(case, {}))


def _weigh(case: Case, grid: GridSettings, wams: WamsSettings) -> None:
    if grid.pss.average == "rotors":
        rotor_weights(case, wams.weights)
    else:
        sensor_weights(case, sensor_buses(case, wams), wams.weights)


def _plan(case: Case, grid: GridSettings, sensors: tuple[int, ...]) -> None:
    plan_events(case, grid, sensors)


def _unknown_sensors(case: Case, wams: WamsSettings) -> list[str]:
    known = [str(number) for number in case.buses.number]
    return [
        f"wams.sensors: no bus {bus} in case '{case.name}'{near(str(bus), known)}"
        for bus in sensor_buses(case, wams)
        if bus not in case.buses.number
    ]


def _unmeasured_average(grid: GridSettings, wams: WamsSettings) -> list[str]:
    if grid.pss.average != "rotors" or wams.reporting == "continuous":
        return []
    return [
        "grid.pss.average: rotors is no measurement, so it needs wams.reporting: continuous "
        f"(got {wams.reporting})"
    ]


def _parts(case: Case) -> list[str]:
    """Return a finding for each part of the network that no branch joins to the slack bus."""
    slack = case.buses.kind.index("slack")
    return [
        f"branch.csv: buses {case.buses.number[island].tolist()} of case '{case.name}' are not "
        f"connected to the slack bus {case.buses.number[slack]}"
        for island in islands(case.branches, len(case.buses.number))
        if slack not in island
    ]


def sensor_buses(case: Case, wams: WamsSettings) -> tuple[int, ...]:
    """Return the bus numbers that carry a PMU in an experiment."""
    return case.base.sensors if wams.sensors == "default" else tuple(wams.sensors)


def controllers(case: Case) -> tuple[tuple[str, int], ...]:
    """Return unit and bus number of each stabiliser of a case."""
    bus_of = dict(zip(case.units, case.buses.number[case.unit_bus].tolist(), strict=True))
    return tuple((device.unit, bus_of[device.unit]) for device in case.devices["pss"])
