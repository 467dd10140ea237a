"""The grid in motion: a state that advances by whole steps, meets events and hears the network."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tieline.errors import NumericalError
from tieline.grid.agenda import Agenda
from tieline.grid.average import inertia, without_tripped
from tieline.grid.conditions import UNIT_QUANTITIES, Condition
from tieline.grid.equations import WBAR, average_now, rhs
from tieline.grid.events import Disturbance
from tieline.grid.integrate import (
    DONE,
    LOST,
    NO_NETWORK_SOLUTION,
    NOT_CONVERGED,
)
from tieline.grid.methods import integrator
from tieline.grid.models.base import SIGNALS
from tieline.grid.plan import HELD, Work
from tieline.grid.sensors import frequencies
from tieline.grid.stability import Ending, lost
from tieline.grid.system import System
from tieline.grid.topology import (
    Change,
    NetworkState,
    changed,
    live_buses,
    units_in_service,
)
from tieline.grid.watch import Watch, centre_of_inertia, write_row
from tieline.grid.wbar import late_average, no_averages

VREF = SIGNALS.index("Vref")

LOOKS_PER_SECOND = 60
"""How often it is checked that every unit is still within bounds."""

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Reading:
    """What the PMUs measure at one instant, arrays (sensors,).

    Attributes:
        v: phasors, pu; f_hz: frequency; rocof_hz_s: its rate of change.
        is_live: False at a bus without voltage.
    """

    v: Complexes
    f_hz: Floats
    rocof_hz_s: Floats
    is_live: NDArray[np.bool_]


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
        events: Sequence[Disturbance] = (),
    ) -> None:
        self.system = system
        self.steps_per_second = steps_per_second
        self.tick = 0
        self.in_service = np.ones(len(system.case.units), dtype=bool)
        self.is_live = np.ones(len(system.flow.v), dtype=bool)
        self.ending: Ending | None = None
        self.log: list[tuple[int, str]] = []
        self._integrator = integrator(method, system, 1.0 / steps_per_second)
        self._plan = system.plan
        self._agenda = Agenda(events)
        self._network = NetworkState()
        self._work = _copy(system.work)
        self._view = _copy(system.work)
        self._x = system.x0.copy()
        self._dx = np.zeros(len(self._x))
        self._averages = no_averages(self._plan.average.delay_steps, len(self.in_service))
        self._inertia = system.case.unit_MVA * inertia(system.case)
        self._watch = self._unrecorded()
        self._on_full: Callable[[Floats], None] = _forget
        self._is_current = False
        self._apply_due()

    @property
    def x(self) -> Floats:
        """Return (n,) the states, a copy."""
        return self._x.copy()

    def _unrecorded(self) -> Watch:
        return Watch(
            per_look=max(1, self.steps_per_second // LOOKS_PER_SECOND),
            omega=self._plan.average.omega,
            delta=self.system.delta,
            weight=self._inertia.copy(),
            per_row=0,
            steps_per_second=self.steps_per_second,
            quantity=np.zeros(0, np.int64),
            scale=np.zeros((0, len(self.in_service))),
            rows=np.zeros((0, 0)),
            noted=np.array([0, -1]),
        )

    def record(
        self,
        per_row: int,
        signals: Sequence[str],
        scale: Floats,
        capacity: int,
        on_full: Callable[[Floats], None],
    ) -> None:
        """Write a row of `watch.Watch` at every `per_row` ticks from now on, as the grid leaves it.

        Args:
            per_row: ticks between two rows.
            signals: the units' signals that are recorded.
            scale: (signals, units) their factors.
            capacity: rows after which `on_full` is called with all of them (rows, values).
            on_full: takes rows, which are overwritten afterwards.
        """
        width = 2 + scale.size + self.system.plan.sensors.pmus + len(self.is_live)
        self._on_full = on_full
        self._watch = self._watch._replace(
            per_row=per_row,
            quantity=np.array([SIGNALS.index(name) for name in signals], np.int64),
            scale=np.ascontiguousarray(scale),
            rows=np.empty((capacity, width)),
        )

    def record_now(self) -> None:
        """Write the present row, and hand over all that were not yet; the last act of a run."""
        watch = self._watch
        if self.ending is None and watch.noted[1] < self.tick:
            self._refresh()
            self._until_full()
            write_row(watch, self._plan.sensors, self._view, self._x, self.tick)
        self.hand_over()

    def hand_over(self) -> None:
        """Give the rows since the last time to whoever records."""
        filled = int(self._watch.noted[0])
        if filled:
            self._watch.noted[0] = 0
            self._on_full(self._watch.rows[:filled])

    def expect(self, due: NDArray[np.int64], told: Floats) -> None:
        """Have stabilisers believe averages as soon as they come.

        Args:
            due: (m,) ascending ticks from the present one on; they replace those given before.
            told: (m, units) what each unit's stabiliser believes from each of them on, pu.
        """
        self._averages = self._averages._replace(due=due, told=told)
        self._hear()

    def modulate(self, unit: int, change_pu: float) -> None:
        """Add to what a unit's exciter takes its terminal voltage for too low by, from now on.

        Every exciter adds the stabiliser's signal to its reference, so the reference carries it.
        """
        self._work.signals[VREF, unit] += change_pu
        self._is_current = False

    def _hear(self) -> None:
        due = self._averages.due
        place = int(np.searchsorted(due, self.tick))
        if place < len(due) and due[place] == self.tick:
            self._work.signals[WBAR] = self._averages.told[place]
            self._is_current = False

    def advance(self, to_tick: int) -> None:
        """Integrate up to a tick, with events and averages on the way and those at `to_tick`.

        Raises:
            NumericalError: a state is no longer finite or the network has no solution; names the
                first state, or the lowest voltage, and the time.
        """
        if to_tick < self.tick:
            raise ValueError(f"tick {to_tick} lies before the current one, {self.tick}")
        while self.tick < to_tick and self.ending is None:
            stop = self._agenda.next_stop(self.tick)
            self._run(min(to_tick, to_tick if stop is None else stop, self._until_full()))
            if self.ending is None:
                self._apply_due()
            self._hear()

    def _until_full(self) -> int:
        """Hand over rows that are full; return the tick up to which there is room for more."""
        watch = self._watch
        if watch.per_row == 0:
            return np.iinfo(np.int64).max
        if watch.noted[0] == len(watch.rows):
            self.hand_over()
        room = len(watch.rows) - int(watch.noted[0])
        return (self.tick // watch.per_row + room) * watch.per_row

    def _run(self, to_tick: int) -> None:
        self._is_current = False
        reached, status = self._integrator.advance(
            self._plan,
            self._work,
            self._watch,
            self._averages,
            self._x,
            self.tick,
            to_tick - self.tick,
        )
        self.tick = reached
        if status == NO_NETWORK_SOLUTION and np.isfinite(self._x).all():
            self._end(Ending(reached, f"voltage collapse: {self._failure(self._work)}"))
        elif status == LOST:
            self._look()
        elif status == NOT_CONVERGED:
            worst = self.system.labels[self._integrator.worst]
            raise NumericalError(
                f"the step from t = {reached / self.steps_per_second:.4f} s did not converge, "
                f"{worst} least of all; try more steps a second"
            )
        elif status != DONE:
            raise NumericalError(self._failure(self._work))

    def _look(self) -> None:
        """End the run if a unit in service is lost."""
        watch = self._watch
        omega, delta = self._x[watch.omega], self._x[watch.delta]
        ending = lost(self.system.case, self.tick, omega, delta, watch.weight)
        if ending is not None:
            self._end(ending)

    def _end(self, ending: Ending) -> None:
        self.ending = ending
        self.log.append((ending.tick, ending.text))

    def _failure(self, work: Work) -> str:
        when = f"at t = {self.tick / self.steps_per_second:.4f} s"
        for bad in np.flatnonzero(~np.isfinite(self._x)):
            return f"{self.system.labels[bad]} is not finite {when}"
        lowest = int(np.argmin(np.abs(work.v)))
        bus = self.system.case.buses.number[lowest]
        return (
            f"the load currents did not converge {when}; "
            f"lowest voltage {abs(work.v[lowest]):.3g} pu at bus {bus}"
        )

    def _apply_due(self) -> None:
        changes = self._agenda.due(self.tick, self._read)
        for change in changes:
            self.log.append((self.tick, change.text))
            for name, unit, size in change.references:
                self._work.signals[SIGNALS.index(name), unit] += size
            self._freeze(change)
            self._network = changed(self._network, change)
        if any(change.is_of_network for change in changes):
            self._rebuild()
        if changes:
            self._is_current = False

    def _rebuild(self) -> None:
        """Give the plan the network that events have left; units and averages follow."""
        case = self.system.case
        self.in_service = units_in_service(case, self._network)
        self._watch.weight[:] = np.where(self.in_service, self._inertia, 0.0)
        live = live_buses(case, self._network)
        dead = case.buses.number[self.is_live & ~live].tolist()
        if dead:
            self.log.append((self.tick, f"buses {dead} are without a unit, and dead"))
        self.is_live = live
        average = without_tripped(self.system.plan.average, self.in_service)
        plan = self.system.after(self._network)
        self._plan = plan._replace(average=average, frozen=self._plan.frozen)
        if average.mode != HELD:
            # A delayed average, too, is without the units that leave from this instant on.
            now = average_now(average, self._plan.sensors, self._x)
            past = self._averages.past
            past[self.tick % len(past)] = now

    def _freeze(self, change: Change) -> None:
        places = [
            place
            for unit in sorted(change.blocked)
            for place, label in enumerate(self.system.labels)
            if label.startswith("governor.") and label.endswith(f".{self.system.case.units[unit]}")
        ]
        frozen = np.array(sorted({*self._plan.frozen.tolist(), *places}), np.int64)
        self._plan = self._plan._replace(frozen=frozen)

    def _read(self, condition: Condition) -> float:
        """Return the present value of a condition's quantity."""
        if condition.quantity == "coi_pu":
            return self.centre_of_inertia()
        if condition.quantity in UNIT_QUANTITIES:
            return float(self.signal(UNIT_QUANTITIES[condition.quantity])[condition.row])
        if condition.quantity == "f_hz":
            return float(self.reading().f_hz[condition.row])
        return float(abs(self.voltages()[condition.row]))

    def _refresh(self) -> None:
        """Bring the view to the states of this tick; the integration itself is not touched.

        The view works on copies: the load currents start their sweeps from the voltages of the
        last stage, and looking at a grid must not change where it goes, not even in the last bit.

        Raises:
            NumericalError: the network has no solution.
        """
        if self._is_current:
            return
        self._view.signals[:] = self._work.signals
        self._view.v[:] = self._work.v
        delay = self._plan.average.delay_steps
        if self._plan.average.mode != HELD and delay > 0:
            self._view.signals[WBAR] = late_average(self._averages.past, self.tick, delay, 0)
        if not rhs(self.system.functions, self._plan, self._view, self._x, self._dx):
            raise NumericalError(self._failure(self._view))
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
        first, bus = sensors.x0 + len(sensors.bus), self.system.sensor_bus
        rocof = self._dx[first : first + len(bus)] / (2.0 * np.pi)
        f_hz = frequencies(sensors, self._x)
        return Reading(self._view.v[bus], f_hz, rocof, self.is_live[bus])

    def centre_of_inertia(self) -> float:
        """Return the speed of the units in service, weighted by stored energy, pu.

        A unit without inertia is left out, and with no other in service the speed is 1.
        """
        return float(centre_of_inertia(self._watch, self._x))


def _forget(rows: Floats) -> None:
    """Take rows that nobody records."""


def _copy(work: Work) -> Work:
    return Work._make(array.copy() for array in work)
