"""A non-windup limit in a run: the state stops on it, stays, and leaves without delay.

A fault at bus 86 from 0.1 s to 0.2 s drives the regulator of G3 into an upper limit that lies
0.2 pu above its operating point.
"""

import numpy as np
import pytest

from grid.runs import FAULT_AT_100_MS, disturbed, speeds, with_values
from tieline.grid.anti_windup import stop_at_limit
from tieline.grid.case import Case
from tieline.grid.powerflow import PowerFlow
from tieline.grid.system import System, build_system

UNIT, STATE = "G3", "exciter.V_R.G3"
ABOVE = 0.2


@pytest.fixture(scope="module")
def limited(system: System, tuned: Case, flow: PowerFlow) -> System:
    """The miniWECC with that limit."""
    highest = system.x0[system.labels.index(STATE)] + ABOVE
    case = with_values(tuned, "exciter", UNIT, VRmax=highest)
    return build_system(case, flow, case.base.sensors)


def highest(system: System) -> float:
    return system.case.device("exciter", UNIT).values["VRmax"]


def course(system: System, method: str, rate: int) -> tuple[np.ndarray, np.ndarray]:
    """V_R of G3 and all speeds at every step of 0.5 s; V_R as it stands once a step has begun."""
    grid = disturbed(system, method, rate, FAULT_AT_100_MS)
    row, regulator, speed = system.labels.index(STATE), [], []
    for tick in range(1, rate // 2 + 1):
        grid.advance(tick)
        regulator.append(grid.x[row])
        speed.append(speeds(grid))
    return np.array(regulator), np.array(speed)


def test_an_implicit_step_ends_on_the_limit_itself(limited: System) -> None:
    """A state that is a little beyond has to come back first: windup."""
    regulator, _ = course(limited, "trapezoid", 60)
    assert regulator.max() == highest(limited)
    assert 3 < (regulator == highest(limited)).sum() < len(regulator) - 10


@pytest.mark.parametrize(("method", "rate"), [("rk4", 240), ("rk3", 240), ("heun", 480)])
def test_an_explicit_step_that_overshot_is_put_back_before_the_next(
    limited: System, method: str, rate: int
) -> None:
    """As above; one instant beyond the limit can be seen, before the next step begins."""
    regulator, _ = course(limited, method, rate)
    over = np.flatnonzero(regulator > highest(limited))
    assert len(over) == 1
    assert regulator[over[0] + 1] == highest(limited)
    held = np.flatnonzero(regulator == highest(limited))
    assert len(held) > 0.05 * rate
    np.testing.assert_array_equal(np.diff(held), 1)


@pytest.mark.parametrize(("method", "coarse"), [("heun", 480), ("rk4", 240), ("trapezoid", 60)])
def test_hitting_and_leaving_a_limit_costs_no_more_than_the_second_order(
    limited: System, method: str, coarse: int
) -> None:
    """Windup by the overshoot of a step, which is proportional to it, would leave order one."""
    exact, _ = course(limited, "rk4", 3840)
    errors = []
    for rate in (coarse, 2 * coarse):
        regulator, _ = course(limited, method, rate)
        after = rate * 3 // 10
        same = exact[3840 // rate * (after + 1) - 1 :: 3840 // rate]
        errors.append(np.abs(regulator[after:] - same).max())
    # The instants of hitting and leaving fall anywhere in a step, so that the ratio is not smooth.
    assert errors[1] < errors[0] / 2.5


def test_every_method_leaves_the_limit_at_the_same_instant(limited: System) -> None:
    """Too late is windup; too early is a limit that does not hold."""
    left = []
    for method, rate in (("trapezoid", 240), ("heun", 480), ("rk4", 960)):
        regulator, _ = course(limited, method, rate)
        left.append(np.flatnonzero(regulator == highest(limited))[-1] / rate)
    # Found on the steps of each, the coarsest of 1/240 s.
    assert np.ptp(left) <= 1 / 240


def test_a_limit_is_found_to_the_last_bit_and_a_smooth_turn_is_none(limited: System) -> None:
    """Bisection must end on the limit, and must not take every turning point for one."""
    row = limited.labels.index(STATE)
    x = limited.x0.copy()
    x[limited.labels.index("exciter.V_A.G3")] += 0.1
    arguments = (limited.functions, limited.plan, limited.work)
    x[row] = highest(limited) + 0.3
    assert stop_at_limit(*arguments, x, row, limited.x0[row])
    assert x[row] == highest(limited)
    x = limited.x0.copy()
    x[row] += 0.1
    assert not stop_at_limit(*arguments, x, row, limited.x0[row] - 0.1)
    assert x[row] == limited.x0[row] + 0.1
