"""Everything about the grid's part of an experiment that can be refused before a process starts."""

from collections.abc import Callable
from dataclasses import dataclass

from tieline.errors import InputError, TielineError
from tieline.grid.case import Case
from tieline.grid.devices import groups, with_pss
from tieline.grid.events import plan_events
from tieline.grid.initialise import initial_states
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
            cannot act, a power flow that diverges, limits violated at the start; every finding.
    """
    findings: list[str] = []

    def attempt(part: Callable[[], object]) -> None:
        try:
            part()
        except InputError as error:
            findings.extend(error.findings)
        except TielineError as error:
            findings.append(str(error))

    def start() -> None:
        initial_states(case, solve_power_flow(case), groups(case, {}))

    sensors = sensor_buses(case, wams)
    known = [str(number) for number in case.buses.number]
    for bus in sensors:
        if bus not in case.buses.number:
            findings.append(
                f"wams.sensors: no bus {bus} in case '{case.name}'{near(str(bus), known)}"
            )
    if grid.pss.average == "rotors" and wams.reporting != "continuous":
        findings.append(
            "grid.pss.average: rotors is no measurement, so it needs wams.reporting: continuous "
            f"(got {wams.reporting})"
        )
    attempt(lambda: with_pss(case, grid.pss))
    attempt(lambda: plan_events(case, grid))
    attempt(start)
    if findings:
        raise InputError(findings)
    return Sites(sensors, controllers(with_pss(case, grid.pss)))


def sensor_buses(case: Case, wams: WamsSettings) -> tuple[int, ...]:
    """Return the bus numbers that carry a PMU in an experiment."""
    return case.base.sensors if wams.sensors == "default" else tuple(wams.sensors)


def controllers(case: Case) -> tuple[tuple[str, int], ...]:
    """Return unit and bus number of each stabiliser of a case."""
    bus_of = dict(zip(case.units, case.buses.number[case.unit_bus].tolist(), strict=True))
    return tuple((device.unit, bus_of[device.unit]) for device in case.devices["pss"])
