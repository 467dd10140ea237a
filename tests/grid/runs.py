"""Grids under way, for the tests of the integration methods."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tieline.grid.case import Case
from tieline.grid.events import plan_events
from tieline.grid.settings import GridSettings
from tieline.grid.simulation import Grid
from tieline.grid.system import System

G26_AT_100_MS = {"at": 0.1, "trip_generator": "G26"}
FAULT_AT_100_MS = {"at": 0.1, "fault_bus": 86, "clear_after": 0.1}


def disturbed(
    system: System, method: str, rate: int, event: Mapping[str, Any] | None = None
) -> Grid:
    """A grid at rest with one event ahead of it."""
    settings = GridSettings.model_validate(
        {
            "duration": 60.0,
            "method": method,
            "steps_per_second": rate,
            "events": [event] if event else [],
        }
    )
    events = plan_events(system.case, settings)
    return Grid(system, method=method, steps_per_second=rate, events=events)


def kicked(system: System, method: str, rate: int) -> Grid:
    """A grid whose rotors have been kicked so gently that no limit is in reach."""
    omega = system.plan.average.omega
    x0 = system.x0.copy()
    x0[omega] += 2e-4 * np.sin(1.0 + np.arange(len(omega)))
    return Grid(replace(system, x0=x0), method=method, steps_per_second=rate)


def with_values(case: Case, role: str, unit: str | None = None, **values: float) -> Case:
    """The case with other parameters of one unit's device, or of every unit's."""
    devices = tuple(
        replace(device, values={**device.values, **values})
        if unit in (None, device.unit)
        else device
        for device in case.devices[role]
    )
    return replace(case, devices={**case.devices, role: devices})


def speeds(grid: Grid) -> np.ndarray:
    """The speeds of all units but G26, which an event may have left alone."""
    keep = [unit != "G26" for unit in grid.system.case.units]
    return grid.x[grid.system.plan.average.omega[keep]]
