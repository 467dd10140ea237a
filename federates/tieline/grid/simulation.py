"""The grid in motion: a state that advances by whole steps, meets events and hears the network."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tieline.errors import NumericalError
from tieline.grid.equations import WBAR, rhs
from tieline.grid.events import Switching
from tieline.grid.integrate import (
    DONE,
    HISTORY_MARGIN,
    METHODS,
    NO_NETWORK_SOLUTION,
    advance,
    late_average,
)
from tieline.grid.loads import load_transfer
from tieline.grid.models.base import SIGNALS
from tieline.grid.network import factorise
from tieline.grid.plan import HELD, ROTORS, Work
from tieline.grid.sensors import frequencies
from tieline.grid.system import System

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Reading:
    """What the PMUs measure at one instant, arrays (sensors,).

    Attributes:
        v: phasors, pu; f_hz: frequency; rocof_hz_s: its rate of change.
    """

    v: Complexes
    f_hz: Floats
    rocof_hz_s: Floats


class Grid:
    """A system that is integrated step by step.

    Time is a whole number of steps, `tick`; no float time is ever compared. What is
    observed at the tick of an event is observed after it: voltages have jumped, states have not.
    """

    def __init__(
        self,
        system: System,
        *,
        method: str,
        steps_per_second: int,
        events: Sequence[Switching] = (),
    ) -> None:
        self.system = system
        self.steps_per_second = steps_per_second
        self.tick = 0
        self.in_service = np.ones(len(system.case.units), dtype=bool)
        self._method = METHODS[method]
        self._plan = system.plan
        self._pending = sorted(events, key=lambda event: event.tick)
        self._is_open: set[int] = set()
        self._work = _copy(system.work)
        self._view = _copy(system.work)
        self._x = system.x0.copy()
        self._k = np.zeros((len(self._method.b) + 1, len(self._x)))
        self._dx = np.zeros(len(self._x))
        self._history = np.ones(self._plan.average.delay_steps + HISTORY_MARGIN)
        self._inertia = system.case.unit_MVA * _inertia(system)
        self._is_current = False
        self._apply_due()

    @property
    def x(self) -> Floats:
        """Return (n,) the states, a copy."""
        return self._x.copy()

    def believe(self, wbar: Floats) -> None:
        """Set the average speed (units,) that each unit's stabiliser believes from now on."""
        self._work.signals[WBAR] = wbar
        self._is_current = False

    def advance(self, to_tick: int) -> None:
        """Integrate up to a tick, with the events on the way and those at `to_tick` itself.

        Raises:
            NumericalError: a state is no longer finite or the network has no solution; names the
                first state, or the lowest voltage, and the time.
        """
        if to_tick < self.tick:
            raise ValueError(f"tick {to_tick} lies before the current one, {self.tick}")
        while self.tick < to_tick:
            self._run(min([to_tick, *(event.tick for event in self._pending[:1])]))
            self._apply_due()

    def _run(self, to_tick: int) -> None:
        self._is_current = False
        reached, status = advance(
            self.system.functions,
            self._plan,
            self._work,
            self._history,
            self._x,
            self._k,
            self.tick,
            to_tick - self.tick,
            1.0 / self.steps_per_second,
            self._method,
        )
        self.tick = reached
        if status != DONE:
            raise NumericalError(self._failure(status))

    def _failure(self, status: int) -> str:
        when = f"at t = {self.tick / self.steps_per_second:.4f} s"
        if status == NO_NETWORK_SOLUTION:
            lowest = int(np.argmin(np.abs(self._work.v)))
            bus = self.system.case.buses.number[lowest]
            size = abs(self._work.v[lowest])
            return (
                f"the load currents did not converge {when}; "
                f"lowest voltage {size:.3g} pu at bus {bus}"
            )
        bad = int(np.flatnonzero(~np.isfinite(self._x))[0])
        return f"{self.system.labels[bad]} is not finite {when}"

    def _apply_due(self) -> None:
        while self._pending and self._pending[0].tick <= self.tick:
            self._apply(self._pending.pop(0))

    def _apply(self, event: Switching) -> None:
        self._is_open |= set(event.branches)
        matrix = self.system.admittance_matrix(sorted(self._is_open))
        self.in_service[list(event.units)] = False
        average = self._plan.average
        if average.mode == ROTORS and event.units:
            weight = np.where(self.in_service, average.weight, 0.0)
            average = average._replace(weight=weight / weight.sum())
        factors = factorise(matrix)
        self._plan = self._plan._replace(
            factors=factors,
            load_transfer=load_transfer(factors, self._plan.loads),
            average=average,
        )
        self._is_current = False

    def _refresh(self) -> None:
        """Bring the view to the states of this tick; the integration itself is not touched.

        The view works on copies: the load currents start their sweeps from the voltages of the
        last stage, and looking at a grid must not change where it goes, not even in the last bit.
        """
        if self._is_current:
            return
        self._view.signals[:] = self._work.signals
        self._view.v[:] = self._work.v
        delay = self._plan.average.delay_steps
        if self._plan.average.mode != HELD and delay > 0:
            self._view.signals[WBAR] = late_average(self._history, self.tick, delay, 0)
        rhs(self.system.functions, self._plan, self._view, self._x, self._dx)
        self._is_current = True

    def signal(self, name: str) -> Floats:
        """Return (units,) a signal now, by its name in `models.base.SIGNALS`."""
        self._refresh()
        return self._view.signals[SIGNALS.index(name)].copy()

    def voltages(self) -> Complexes:
        """Return (buses,) the bus voltages now, pu."""
        self._refresh()
        return self._view.v.copy()

    def reading(self) -> Reading:
        """Return what the PMUs measure now."""
        self._refresh()
        sensors = self.system.plan.sensors
        first = sensors.x0 + len(sensors.bus)
        rocof = self._dx[first : first + len(sensors.bus)] / (2.0 * np.pi)
        return Reading(self._view.v[sensors.bus], frequencies(sensors, self._x), rocof)

    def centre_of_inertia(self) -> float:
        """Return the speed of the units in service, weighted by stored energy, pu."""
        omega = self._x[self._plan.average.omega]
        weight = np.where(self.in_service, self._inertia, 0.0)
        return float(1.0 + (weight * (omega - 1.0)).sum() / weight.sum())


def _copy(work: Work) -> Work:
    return Work._make(array.copy() for array in work)


def _inertia(system: System) -> Floats:
    """Return (units,) inertia constants H, s on the machine base."""
    return np.array([device.values["H"] for device in system.case.devices["machine"]])
