"""The implicit trapezoidal method, for stiff parameters and steps as long as 1/60 s.

    x1 = x0 + h/2 [f(x0) + f(x1)]

solved by Newton's method with the block elimination of `jacobian.py`, whose matrices are kept over
many steps, for as long as the corrections shrink fast with them. f(x0) is evaluated anew at each
step, with the voltages and averages as an event or a delivery has left them: no step reaches
across one, and none costs an order.

The method is of order 2 and A-stable. What is much faster than the step neither grows nor dies out
at once: a disturbance leaves a ripple in such states for some steps. Source: Hairer and Wanner,
Solving Ordinary Differential Equations II, sections IV.3 and IV.8.
"""

import numpy as np
from numpy.typing import NDArray

from tieline.grid.anti_windup import stop_at_limit
from tieline.grid.blocks import cut
from tieline.grid.equations import WBAR, average_now, rhs
from tieline.grid.integrate import (
    DONE,
    LOST,
    MOVED,
    NO_NETWORK_SOLUTION,
    NOT_CONVERGED,
)
from tieline.grid.jacobian import Elimination, differentiate, eliminate
from tieline.grid.newton import (
    MAX_ITERATIONS,
    SLOW,
    TIRED,
    WITH_CARE,
    advance,
    begin,
    empty_step,
    improve,
    is_solved,
)
from tieline.grid.plan import HELD, Plan, Work
from tieline.grid.system import System
from tieline.grid.watch import Watch, has_lost, note
from tieline.grid.wbar import Averages, hear, late_average

Floats = NDArray[np.float64]

NEWTON_ITERATIONS = 60
"""Most iterations of the second attempt, in which every one has matrices of its own."""
NEAR = 1e-3
"""How far a limit that moves is looked for around its last place."""


class Trapezoid:
    """The implicit trapezoidal method at work on one system, in steps of `h` seconds.

    Its matrices live on from call to call, so that the way of stepping changes no bit. A plan that
    an event has put in place of the old one makes it begin anew.
    """

    def __init__(self, system: System, h: float) -> None:
        self._functions = system.functions
        self._h = h
        self._blocks = cut(system.plan, len(system.x0))
        self._by: Elimination | None = None
        self._plan = system.plan
        self._step = empty_step(len(system.x0), len(system.work.v))

    @property
    def worst(self) -> int:
        """Return the place of the state whose last correction was the largest."""
        return int(self._step.worst[0])

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
        """Integrate `x` in place, as `integrate.Integrator` says."""
        if plan is not self._plan:
            self._plan, self._by = plan, None
        end = tick + steps
        while tick < end:
            status = WITH_CARE
            if self._by is not None:
                tick, status = advance(
                    self._functions, plan, work, self._blocks, self._by, self._step,
                    watch, averages, x, tick, end - tick, self._h,
                )  # fmt: skip
            if status == WITH_CARE:
                status = self._step_with_care(plan, work, watch, averages, x, tick)
                tick += status in (DONE, LOST)
            elif status == TIRED:
                self._by, status = None, DONE
            if status != DONE:
                return tick, status
        return end, DONE

    def _step_with_care(
        self, plan: Plan, work: Work, watch: Watch, averages: Averages, x: Floats, tick: int
    ) -> int:
        """Take one step, with new matrices where it needs them; return its status.

        Where that fails it is tried once more, with new matrices at every iteration.
        """
        s, average = self._step, plan.average
        is_late = average.mode != HELD and average.delay_steps > 0
        side, status = s.side.copy(), NOT_CONVERGED
        s.x0[:] = x
        hear(averages, tick, work.signals[WBAR])
        for is_newton in (False, True):
            if is_late:
                work.signals[WBAR] = late_average(averages.past, tick, average.delay_steps, 0)
            if not rhs(self._functions, plan, work, s.x0, s.f0):
                return NO_NETWORK_SOLUTION
            note(watch, plan.sensors, work, x, tick)
            if is_late:
                work.signals[WBAR] = late_average(averages.past, tick, average.delay_steps, 2)
            begin(s, x, work.v)
            status = self._iterate(plan, work, x, is_newton)
            if status == DONE:
                break
            x[:], work.v[:], s.side[:] = s.x0, s.v0, side
        if status == DONE and average.mode != HELD:
            past = averages.past
            past[(tick + 1) % len(past)] = average_now(average, plan.sensors, x)
        if status == DONE and has_lost(watch, x, tick + 1):
            return LOST
        return status

    def _iterate(self, plan: Plan, work: Work, x: Floats, is_newton: bool) -> int:
        """Bring `x` from the start of a step to its end; return a status.

        With `is_newton`, a state that goes to and fro, as from one end of a limiter to the other,
        takes a smaller share of its correction each time.
        """
        s, size, last = self._step, np.inf, np.inf
        share, earlier = np.ones_like(x), np.zeros_like(x)
        for iteration in range(NEWTON_ITERATIONS if is_newton else MAX_ITERATIONS):
            if iteration > 0:
                if not rhs(self._functions, plan, work, x, s.f1):
                    return NO_NETWORK_SOLUTION
                is_slow = iteration > 2 and size > SLOW * last
                if self._meet_limits(plan, work, x, is_slow) or is_slow:
                    self._by = None
            if self._by is None or is_newton:
                at = differentiate(self._functions, plan, work, self._blocks, x)
                self._by = eliminate(self._blocks, at, s.side != 0.0, 0.5 * self._h)
            if self._by is None:
                return NOT_CONVERGED
            last, size = size, improve(self._blocks, self._by, s, x, 0.5 * self._h)
            if not size < np.inf:
                return NOT_CONVERGED
            if is_newton:
                is_turned = s.dx * earlier < -0.5 * earlier**2
                share[is_turned] *= 0.5
                share[np.abs(s.dx) < 0.5 * np.abs(earlier)] = 1.0
                x -= (1.0 - share) * s.dx
                earlier[:] = s.dx
            if is_solved(size, np.inf if is_newton else last):
                return DONE
        return NOT_CONVERGED

    def _meet_limits(self, plan: Plan, work: Work, x: Floats, is_slow: bool) -> bool:
        """Hold states that ran past a limit, release those that leave it; return whether any did.

        A derivative of exactly 0 tells a state beyond its limit. Where the iteration is slow, every
        one that points back may hide a jump.
        """
        s, changed = self._step, False
        for i in np.flatnonzero((s.side != 0.0) & (s.f1 != 0.0)).tolist():
            if not self._follow(plan, work, x, i):
                s.side[i] = 0.0
                changed = True
        moved = x - s.x0
        turned = (s.f1 == 0.0) | (is_slow & (s.f1 * moved < 0.0))
        suspects = (s.side == 0.0) & turned & (np.abs(moved) > MOVED)
        for i in np.flatnonzero(suspects).tolist():
            if stop_at_limit(self._functions, plan, work, x, i, s.x0[i]):
                s.side[i] = np.sign(moved[i])
                s.f1[i] = 0.0
                changed = True
        return changed

    def _follow(self, plan: Plan, work: Work, x: Floats, i: int) -> bool:
        """Put a held state on its limit, which has moved; return whether it stays there."""
        was, reach = x[i], self._step.side[i] * NEAR * max(1.0, abs(x[i]))
        x[i] = was + reach
        if stop_at_limit(self._functions, plan, work, x, i, was - reach):
            return True
        x[i] = was
        return False
