"""Fixed-step integration: Heun (order 2), Kutta's method (3) and the classical Runge-Kutta one (4).

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_in_place
from tieline.grid.anti_windup import stop_at_limit
from tieline.grid.equations import WBAR, average_now, rhs
from tieline.grid.plan import HELD, Plan, Work
from tieline.grid.system import System
from tieline.grid.watch import Watch, has_lost, note
from tieline.grid.wbar import Averages, hear, late_average

Floats = NDArray[np.float64]


class Tableau(NamedTuple):
    """An explicit Runge-Kutta method whose stages fall on half steps.

    Attributes:
        a: (stages, stages) weights of earlier stages; b: (stages,) weights of the step.
        half: (stages,) instant of each stage in half steps.
    """

    a: Floats
    b: Floats
    half: NDArray[np.int64]


METHODS = {
    "heun": Tableau(
        a=np.array([[0.0, 0.0], [1.0, 0.0]]), b=np.array([0.5, 0.5]), half=np.array([0, 2])
    ),
    "rk3": Tableau(
        a=np.array([[0, 0, 0], [0.5, 0, 0], [-1.0, 2.0, 0]]),
        b=np.array([1 / 6, 2 / 3, 1 / 6]),
        half=np.array([0, 1, 2]),
    ),
    "rk4": Tableau(
        a=np.array([[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1.0, 0]]),
        b=np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6]),
        half=np.array([0, 1, 1, 2]),
    ),
}

DONE, NO_NETWORK_SOLUTION, NOT_FINITE, NOT_CONVERGED, LOST = 0, 1, 2, 3, 4

AT_LIMIT = -1
"""A state may have run past a non-windup limit in the step before."""

MOVED = 1e-9
"""Least motion in a step of a state that is taken to run into a limit."""


@compiled_in_place
def set_to(x: Floats, values: Floats) -> None:
    """Write values (n,) into states (n,)."""
    for i in range(len(x)):
        x[i] = values[i]


@compiled_in_place
def add(x: Floats, share: float, rates: Floats) -> None:
    """Add a share (s) of some rates to states, in place; nothing where the share is 0."""
    if share != 0.0:
        for i in range(len(x)):
            x[i] += share * rates[i]


@compiled_in_place
def is_finite(x: Floats) -> bool:
    """Return whether every state is a finite number."""
    total = 0.0
    for value in x:
        total += 0.0 * value
    return total == 0.0


@compiled_in_place
def advance(
    functions: Any,
    plan: Plan,
    work: Work,
    watch: Watch,
    averages: Averages,
    x: Floats,
    before: Floats,
    k: Floats,
    tick: int,
    steps: int,
    h: float,
    method: Tableau,
) -> tuple[int, int]:
    """Integrate `x` in place over `steps` steps of `h` seconds from `tick`.

    Args:
        functions, plan, work: the system.
        watch: what is looked at on the way.
        averages: of the past, and those that will be heard on the way.
        x: states (n,); before: the same one step ago; k: scratch (stages + 1, n).
        tick, steps, h, method: where it starts, how far, step in s, tableau.

    Returns:
        The tick reached and `DONE` or `LOST`, or the tick of the step that was not taken and why.
    """
    is_late = plan.average.mode != HELD and plan.average.delay_steps > 0
    stages = len(method.b)
    at_stage = k[stages]
    for now in range(tick, tick + steps):
        hear(averages, now, work.signals[WBAR])
        for stage in range(stages):
            set_to(at_stage, x)
            for earlier in range(stage):
                add(at_stage, h * method.a[stage, earlier], k[earlier])
            if is_late:
                delay = plan.average.delay_steps
                work.signals[WBAR] = late_average(averages.past, now, delay, method.half[stage])
            if not rhs(functions, plan, work, at_stage, k[stage]):
                return now, NO_NETWORK_SOLUTION
            if stage == 0:
                note(watch, plan.sensors, work, x, now)
                for i in range(len(x)):
                    if k[0, i] == 0.0 and abs(x[i] - before[i]) > MOVED:
                        return now, AT_LIMIT
        set_to(before, x)
        for stage in range(stages):
            add(x, h * method.b[stage], k[stage])
        if not is_finite(x):
            return now, NOT_FINITE
        if plan.average.mode != HELD:
            past = averages.past
            past[(now + 1) % len(past)] = average_now(plan.average, plan.sensors, x)
        if has_lost(watch, x, now + 1):
            return now + 1, LOST
    return tick + steps, DONE


class Integrator(Protocol):
    """A method at work on one system in steps of one length; the way of stepping changes no bit."""

    @property
    def worst(self) -> int:
        """Return the place of the state that kept a step from converging."""
        ...

    def advance(
        self,
        plan: Plan,
        work: Work,
        watch: Watch,
        averages: Averages,
        x: Floats,
        tick: int,
        steps: int,
    ) -> tuple[int, int]:
        """Integrate `x` in place over `steps` steps from `tick`.

        Args:
            plan, work: the system as it is now.
            watch: what is looked at on the way; the row of the last tick is the next call's.
            averages: of the past, and those that will be heard on the way.
            x: states (n,).
            tick, steps: where it starts and how far.

        Returns:
            The tick reached and `DONE`, or `LOST` where a unit is, or the tick of the step that
            failed and why.
        """
        ...


class RungeKutta:
    """An explicit method at work on one system, in steps of `h` seconds.

    A state that has run past a non-windup limit in a step is put back on it before the next one
    begins; what is looked at in between sees it beyond the limit, and the signal that it drives at
    the limit.
    """

    def __init__(self, system: System, method: Tableau, h: float) -> None:
        self._functions = system.functions
        self._method = method
        self._h = h
        self._before = system.x0.copy()
        self._k = np.zeros((len(method.b) + 1, len(system.x0)))

    @property
    def worst(self) -> int:
        """Return 0: an explicit step has nothing to converge."""
        return 0

    def advance(
        self,
        plan: Plan,
        work: Work,
        watch: Watch,
        averages: Averages,
        x: Floats,
        tick: int,
        steps: int,
    ) -> tuple[int, int]:
        """Integrate `x` in place, as `Integrator` says."""
        end, status = tick + steps, AT_LIMIT
        while status == AT_LIMIT:
            tick, status = advance(
                self._functions, plan, work, watch, averages, x, self._before, self._k,
                tick, end - tick, self._h, self._method,
            )  # fmt: skip
            if status == AT_LIMIT:
                self._put_back(plan, work, x)
        return tick, status

    def _put_back(self, plan: Plan, work: Work, x: Floats) -> None:
        stopped = (self._k[0] == 0.0) & (np.abs(x - self._before) > MOVED)
        for i in np.flatnonzero(stopped).tolist():
            stop_at_limit(self._functions, plan, work, x, i, self._before[i])
        self._before[:] = x
