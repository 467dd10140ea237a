"""Fixed-step integration: Heun (order 2) and the classical Runge-Kutta method (order 4).

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.equations import WBAR, average_now, rhs
from tieline.grid.plan import HELD, Plan, Work

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
    "rk4": Tableau(
        a=np.array([[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1.0, 0]]),
        b=np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6]),
        half=np.array([0, 1, 1, 2]),
    ),
}

DONE, NO_NETWORK_SOLUTION, NOT_FINITE = 0, 1, 2

HISTORY_MARGIN = 4
"""Instants that the history of a delayed average holds beyond its delay."""


@compiled
def late_average(history: Floats, tick: int, delay: int, half: int) -> float:
    """Return the average `delay` steps before `tick` (plus `half` half steps).

    Between two steps it is the cubic through the four nearest instants, of the same order as RK4.
    """
    size = len(history)
    at = tick - delay
    if half == 0:
        return history[at % size]
    if half == 2:
        return history[(at + 1) % size]
    inner = history[at % size] + history[(at + 1) % size]
    outer = history[(at - 1) % size] + history[(at + 2) % size]
    return (9.0 * inner - outer) / 16.0


@compiled
def advance(
    functions: Any,
    plan: Plan,
    work: Work,
    history: Floats,
    x: Floats,
    k: Floats,
    tick: int,
    steps: int,
    h: float,
    method: Tableau,
) -> tuple[int, int]:
    """Integrate `x` in place over `steps` steps of `h` seconds from `tick`.

    Args:
        functions, plan, work: the system.
        history: ring of past averages, indexed by tick; holds the delay and a margin.
        x: states (n,); k: scratch (stages + 1, n).
        tick, steps, h, method: where it starts, how far, step in s, tableau.

    Returns:
        The tick reached and `DONE`, or the tick of the step that failed and why.
    """
    is_late = plan.average.mode != HELD and plan.average.delay_steps > 0
    stages = len(method.b)
    at_stage = k[stages]
    for now in range(tick, tick + steps):
        for stage in range(stages):
            at_stage[:] = x
            for earlier in range(stage):
                if method.a[stage, earlier] != 0.0:
                    at_stage += (h * method.a[stage, earlier]) * k[earlier]
            if is_late:
                delay = plan.average.delay_steps
                work.signals[WBAR] = late_average(history, now, delay, method.half[stage])
            if not rhs(functions, plan, work, at_stage, k[stage]):
                return now, NO_NETWORK_SOLUTION
        for stage in range(stages):
            x += (h * method.b[stage]) * k[stage]
        if not np.isfinite(x).all():
            return now, NOT_FINITE
        if plan.average.mode != HELD:
            history[(now + 1) % len(history)] = average_now(plan.average, plan.sensors, x)
    return tick + steps, DONE
