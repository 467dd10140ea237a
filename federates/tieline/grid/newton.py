"""Steps of the implicit trapezoidal method as compiled kernels, for as long as all goes smoothly.

    x1 = x0 + h/2 [f(x0) + f(x1)]

is solved by simplified Newton iteration: the matrices of `jacobian.py` are kept over many steps. A
step that is slow to converge or meets a limit is left to `implicit.py`. Source: Hairer and Wanner,
Solving Ordinary Differential Equations II, section IV.8.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.grid.blocks import Blocks
from tieline.grid.equations import WBAR, average_now, rhs
from tieline.grid.integrate import DONE, LOST, MOVED, NO_NETWORK_SOLUTION
from tieline.grid.jacobian import Elimination, correct
from tieline.grid.plan import HELD, Plan, Work
from tieline.grid.watch import Watch, has_lost, note
from tieline.grid.wbar import Averages, hear, late_average

Floats = NDArray[np.float64]

TOLERANCE = 1e-9
"""Largest error that a solved step leaves in a state, in pu or rad, relative where it exceeds 1."""

MAX_ITERATIONS = 20
SLOW = 0.3
"""A correction larger than this part of the one before asks for a new Jacobian at once."""
MANY = 8
"""A step of more iterations asks for a new Jacobian at the next one."""
LUCK = 0.05
"""The error left is taken to be at least this part of a correction, however fast it shrank."""

WITH_CARE = -1
"""The step did not go smoothly: it is to be taken again, with a new Jacobian where it needs one."""
TIRED = -2
"""The step is done, but the Jacobian has aged."""


class Step(NamedTuple):
    """Arrays (n,) of a step: its start, derivatives at both ends, residual and correction.

    Attributes:
        side: +1 or -1 for a state held at its upper or lower limit, else 0.
        v0: (buses,) voltages at the start.
        worst: (1,) state with the largest correction.
    """

    x0: Floats
    f0: Floats
    f1: Floats
    residual: Floats
    dx: Floats
    side: Floats
    v0: NDArray[np.complex128]
    worst: NDArray[np.int64]


@compiled
def begin(s: Step, x: Floats, v: NDArray[np.complex128]) -> None:
    """Make the present the start of a step, once `f0` is known; the end is first sought there."""
    s.v0[:] = v
    for i in range(len(x)):
        # The last digits of a limit that moves must not let a state that is held there go out.
        if s.side[i] * s.f0[i] > 0.0:
            s.f0[i] = 0.0
        s.f1[i] = s.f0[i]


@compiled
def improve(blocks: Blocks, by: Elimination, s: Step, x: Floats, a: float) -> float:
    """Correct `x` once, for a = h/2; return the largest correction, relative to a state beyond 1.

    It is infinite where one is no number.
    """
    for i in range(len(x)):
        s.residual[i] = s.x0[i] - x[i] + a * (s.f0[i] + s.f1[i]) if s.side[i] == 0.0 else 0.0
    correct(blocks, by, s.residual, s.dx)
    largest = 0.0
    for i in range(len(x)):
        x[i] += s.dx[i]
        size = abs(s.dx[i]) / max(1.0, abs(s.x0[i]))
        if not size <= largest:
            largest = size if size < np.inf else np.inf
            s.worst[0] = i
    return largest


@compiled
def is_solved(size: float, last: float) -> bool:
    """Return whether a correction of `size` after one of size `last` leaves less than `TOLERANCE`.

    Were every next one smaller by the same factor q, they would sum to q / (1 - q) of this one.
    """
    q = max(size / last, LUCK) if last < np.inf else 1.0
    return size <= TOLERANCE or (q < 1.0 and q / (1.0 - q) * size <= TOLERANCE)


@compiled
def meets_limit(s: Step, x: Floats) -> bool:
    """Return whether a state may have run past a limit, or leave the one where it is held."""
    for i in range(len(x)):
        if s.side[i] != 0.0:
            if s.f1[i] != 0.0:
                return True
        elif s.f1[i] == 0.0 and abs(x[i] - s.x0[i]) > MOVED:
            return True
    return False


@compiled
def advance(
    functions: Any,
    plan: Plan,
    work: Work,
    blocks: Blocks,
    by: Elimination,
    s: Step,
    watch: Watch,
    averages: Averages,
    x: Floats,
    tick: int,
    steps: int,
    h: float,
) -> tuple[int, int]:
    """Integrate `x` in place over `steps` steps of `h` seconds from `tick`, as long as all is easy.

    Args:
        functions, plan, work: the system.
        blocks, by, s: how it is solved.
        watch: what is looked at on the way.
        averages: of the past, and those that will be heard on the way.
        x: states (n,).
        tick, steps, h: where it starts, how far, step in s.

    Returns:
        The tick reached, and `DONE`, `LOST`, `TIRED`, `WITH_CARE` or why it failed.
    """
    is_late = plan.average.mode != HELD and plan.average.delay_steps > 0
    for now in range(tick, tick + steps):
        s.x0[:] = x
        hear(averages, now, work.signals[WBAR])
        if is_late:
            work.signals[WBAR] = late_average(averages.past, now, plan.average.delay_steps, 0)
        if not rhs(functions, plan, work, s.x0, s.f0):
            return now, NO_NETWORK_SOLUTION
        note(watch, plan.sensors, work, x, now)
        if is_late:
            work.signals[WBAR] = late_average(averages.past, now, plan.average.delay_steps, 2)
        begin(s, x, work.v)
        last, iterations, is_easy = np.inf, 0, True
        while is_easy:
            size = improve(blocks, by, s, x, 0.5 * h)
            iterations += 1
            if is_solved(size, last):
                break
            is_easy = size < np.inf and iterations < MAX_ITERATIONS
            is_easy = is_easy and (iterations <= 2 or size <= SLOW * last)
            is_easy = is_easy and rhs(functions, plan, work, x, s.f1) and not meets_limit(s, x)
            last = size
        if not is_easy:
            x[:], work.v[:] = s.x0, s.v0
            return now, WITH_CARE
        if plan.average.mode != HELD:
            past = averages.past
            past[(now + 1) % len(past)] = average_now(plan.average, plan.sensors, x)
        if has_lost(watch, x, now + 1):
            return now + 1, LOST
        if iterations > MANY:
            return now + 1, TIRED
    return tick + steps, DONE


def empty_step(states: int, buses: int) -> Step:
    """Return arrays for a system of `states` states and `buses` buses."""
    x0, f0, f1, residual, dx, side = np.zeros((6, states))
    v0, worst = np.zeros(buses, np.complex128), np.zeros(1, np.int64)
    return Step(x0, f0, f1, residual, dx, side, v0, worst)
