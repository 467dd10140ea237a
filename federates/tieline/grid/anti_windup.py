"""Finds the non-windup limits that states ran past in a step, from the equations alone.

The standard's anti-windup figures (IEEE Std 421.5-2016, Annex E) stop a state at its limit and
let it leave as soon as its derivative points inwards. In the equations this is a jump: along the
state itself the derivative leads outwards up to the limit, and from there on not any more. A method
of finite steps meets the jump only after it has run past it, so that the state would have to come
back before it can leave: windup after all. The jump is therefore looked for by bisection, which
ends on the very limit, and the state is put there. A model declares nothing for it.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.grid.equations import rhs_at_voltages
from tieline.grid.plan import Plan, Work

Floats = NDArray[np.float64]

LARGE = 1e-6
"""Least derivative in pu/s that ends in a jump; a smaller one moves no state that matters."""


def stop_at_limit(functions: Any, plan: Plan, work: Work, x: Floats, i: int, inside: float) -> bool:
    """Put state `i` of `x` on the limit between `inside` and where it is, if there is one.

    Args:
        functions, plan, work: the system; its voltages stay, its signals do not.
        x: states (n,), of which `i` is the only one to move.
        inside: a value of the state on the other side of the limit.

    Returns:
        Whether there is a limit: where a derivative larger than `LARGE` ends in a jump.
    """
    outside = float(x[i])
    sign = np.sign(outside - inside)
    trial, f = x.copy(), np.zeros_like(x)

    def outwards(value: float) -> float:
        trial[i] = value
        rhs_at_voltages(functions, plan, work, trial, f)
        return float(sign * f[i])

    rate = outwards(inside) if outwards(outside) <= 0.0 else 0.0
    while rate > LARGE:
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            x[i] = outside
            return True
        at_middle = outwards(middle)
        if at_middle > 0.0:
            inside, rate = middle, at_middle
        else:
            outside = middle
    return False
