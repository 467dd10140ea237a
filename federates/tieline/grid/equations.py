"""The right-hand side of the whole system: sources, network, sensors, controls, machines."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.by_address import caller
from tieline.compiled import compiled_in_place
from tieline.grid.loads import settle
from tieline.grid.models.base import SIGNALS, SIGNATURE
from tieline.grid.plan import HELD, SENSORS, Average, Jobs, Plan, Work
from tieline.grid.sensors import Sensors, filter_angles

Floats = NDArray[np.float64]

OMEGA, V_RE, V_IM, VT = (SIGNALS.index(name) for name in ("omega", "v_re", "v_im", "vt"))
EPP_RE, EPP_IM, WBAR = (SIGNALS.index(name) for name in ("Epp_re", "Epp_im", "wbar"))

call = caller(SIGNATURE)


@compiled_in_place
def run_job(functions: Any, jobs: Jobs, work: Work, j: int, x: Floats, dx: Floats) -> None:
    """Evaluate job `j`: gather its inputs, call its equation, scatter its outputs."""
    n, states, rows = jobs.n[j], jobs.n_states[j], jobs.n_parameters[j]
    first_in, last_in = jobs.inputs_at[j], jobs.inputs_at[j + 1]
    first_out, last_out = jobs.outputs_at[j], jobs.outputs_at[j + 1]
    units = jobs.units[jobs.units_at[j] : jobs.units_at[j + 1]]
    u = work.u[: (last_in - first_in) * n].reshape(last_in - first_in, n)
    y = work.y[: (last_out - first_out) * n].reshape(last_out - first_out, n)
    x_j = x[jobs.x0[j] : jobs.x0[j] + states * n].reshape(states, n)
    dx_j = dx[jobs.x0[j] : jobs.x0[j] + states * n].reshape(states, n)
    p_j = jobs.parameters[jobs.p0[j] : jobs.p0[j] + rows * n].reshape(rows, n)
    for i in range(last_in - first_in):
        for unit in range(n):
            u[i, unit] = work.signals[jobs.inputs[first_in + i], units[unit]]
    call(functions, jobs.function[j], (x_j, u, p_j, dx_j, y))
    for i in range(last_out - first_out):
        for unit in range(n):
            work.signals[jobs.outputs[first_out + i], units[unit]] = y[i, unit]


@compiled_in_place
def solve_network(plan: Plan, work: Work) -> bool:
    """Write all bus voltages for the machines' sources; return whether the loads converged."""
    signals = work.signals
    work.source[:] = 0.0
    for i in range(len(plan.unit_bus)):
        inner = complex(signals[EPP_RE, i], signals[EPP_IM, i])
        work.source[plan.unit_bus[i]] += plan.unit_admittance[i] * inner
    converged = settle(
        plan.load_network, plan.factors, work.load_factor, work.source, work.scratch, work.v
    )
    show_voltages(plan, work)
    return converged


@compiled_in_place
def follow_frequency(plan: Plan, work: Work, x: Floats) -> None:
    """Write how much more (or less) each load draws at the frequency of its own bus."""
    loads, sensors = plan.loads, plan.sensors
    z2 = sensors.x0 + len(sensors.bus)
    for k in range(len(loads.bus)):
        if loads.filter[k] >= 0:
            deviation = x[z2 + loads.filter[k]] / (2.0 * np.pi * sensors.f0_Hz)
            work.load_factor[0, k] = 1.0 + loads.p_frequency[k] * deviation
            work.load_factor[1, k] = 1.0 + loads.q_frequency[k] * deviation


@compiled_in_place
def show_voltages(plan: Plan, work: Work) -> None:
    """Write the bus voltages of `work` as the signals of its units."""
    signals = work.signals
    for i in range(len(plan.unit_bus)):
        v = work.v[plan.unit_bus[i]]
        signals[V_RE, i], signals[V_IM, i], signals[VT, i] = v.real, v.imag, abs(v)


@compiled_in_place
def average_now(average: Average, sensors: Sensors, x: Floats) -> float:
    """Return wbar as the states of `x` give it, pu; exactly 1 at rest."""
    total = 0.0
    if average.mode == SENSORS:
        z2 = sensors.x0 + len(sensors.bus)
        for k in range(sensors.pmus):
            total += average.weight[k] * x[z2 + k]
        return 1.0 + total / (2.0 * np.pi * sensors.f0_Hz)
    for k in range(len(average.omega)):
        total += average.weight[k] * (x[average.omega[k]] - 1.0)
    return 1.0 + total


@compiled_in_place
def rhs(functions: Any, plan: Plan, work: Work, x: Floats, dx: Floats) -> bool:
    """Write dx/dt and every signal at `x`; return whether the network was solved.

    wbar is formed here only when it is neither held nor delayed; else the row stands as it is.
    """
    solved = True
    for j in range(len(plan.jobs.function)):
        if j == plan.jobs.before_network:
            follow_frequency(plan, work, x)
            solved = solve_network(plan, work)
            filter_angles(plan.sensors, work.v, x, dx)
            if plan.average.mode != HELD and plan.average.delay_steps == 0:
                work.signals[WBAR] = average_now(plan.average, plan.sensors, x)
        run_job(functions, plan.jobs, work, j, x, dx)
    for place in plan.frozen:
        dx[place] = 0.0
    return solved


@compiled_in_place
def rhs_at_voltages(functions: Any, plan: Plan, work: Work, x: Floats, dx: Floats) -> None:
    """Write dx/dt and every signal at `x`, with the voltages and wbar as they stand in `work`."""
    for j in range(len(plan.jobs.function)):
        run_job(functions, plan.jobs, work, j, x, dx)
    filter_angles(plan.sensors, work.v, x, dx)
    for place in plan.frozen:
        dx[place] = 0.0
