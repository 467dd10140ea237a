"""Fixed-step integration: Heun (order 2) and the classical Runge-Kutta method (order 4).

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.equations import WBAR, average_now, rhs
from tieline.grid.plan import HELD, Plan, Work

Floats = NDArray[np.float64]

HEUN, RK4 = 0, 1
METHODS = {"heun": HEUN, "rk4": RK4}

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
def stage(
    functions: Any,
    plan: Plan,
    work: Work,
    history: Floats,
    tick: int,
    half: int,
    x: Floats,
    dx: Floats,
) -> bool:
    """Evaluate the right-hand side `half` half steps after `tick`."""
    if plan.average.mode != HELD and plan.average.delay_steps > 0:
        work.signals[WBAR] = late_average(history, tick, plan.average.delay_steps, half)
    return rhs(functions, plan, work, x, dx)


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
    method: int,
) -> tuple[int, int]:
    """Integrate `x` in place over `steps` steps of `h` seconds from `tick`.

    Args:
        functions, plan, work: the system.
        history: ring of past averages, indexed by tick; holds the delay and a margin.
        x: states (n,); k: scratch (5, n).
        tick, steps, h, method: where it starts, how far, step in s, `HEUN` or `RK4`.

    Returns:
        The tick reached and `DONE`, or the tick of the step that failed and why.
    """
    ring = len(history)
    for now in range(tick, tick + steps):
        solved = stage(functions, plan, work, history, now, 0, x, k[0])
        if method == HEUN:
            k[4] = x + h * k[0]
            solved &= stage(functions, plan, work, history, now, 2, k[4], k[1])
            x += (0.5 * h) * (k[0] + k[1])
        else:
            k[4] = x + (0.5 * h) * k[0]
            solved &= stage(functions, plan, work, history, now, 1, k[4], k[1])
            k[4] = x + (0.5 * h) * k[1]
            solved &= stage(functions, plan, work, history, now, 1, k[4], k[2])
            k[4] = x + h * k[2]
            solved &= stage(functions, plan, work, history, now, 2, k[4], k[3])
            x += (h / 6.0) * (k[0] + 2.0 * (k[1] + k[2]) + k[3])
        if not np.isfinite(x).all():
            return now, NOT_FINITE
        if not solved:
            return now, NO_NETWORK_SOLUTION
        if plan.average.mode != HELD:
            history[(now + 1) % ring] = average_now(plan.average, plan.sensors, x)
    return tick + steps, DONE
