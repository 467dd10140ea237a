"""The matrices of a system by moving one thing after the other in what is integrated.

Nothing is taken apart here: every sample solves the network and evaluates all equations, and every
output is read off the result. What moves and what is read goes by the names of `LinearSystem`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tieline.grid.case import Case
from tieline.grid.equations import average_now, rhs
from tieline.grid.models.base import SIGNALS
from tieline.grid.plan import HELD, Plan, Work
from tieline.grid.sensors import frequencies
from tieline.grid.system import System
from tieline.grid.topology import NetworkState

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

MOVE = 4e-5
"""Half the distance of two samples, pu or rad. The truncation is of its square, 2e-9, and what the
network's tolerance of 1e-12 pu leaves of a voltage's slope is below 3e-8."""

DRAWN = 2e-3
"""The same for a power drawn at a bus, pu. It changes the network's factors, which then round
otherwise, and moves voltages by a hundredth of itself or so."""

ROWS = {"Vref": "Vref", "Pref": "Pref", "w0": "w0", "wbar": "wbar", "vs": "v_s"}


def held(plan: Plan) -> Plan:
    """The plan in which every unit goes on believing the average that it was told."""
    return plan._replace(average=plan.average._replace(mode=HELD))


def flows(case: Case, v: Complexes) -> Floats:
    """Power into every branch at its `from` end: an ideal tap, then a pi section."""
    branches = case.branches
    behind = v[branches.start] / branches.tap
    charging = 0.5j * branches.susceptance * behind
    current = (behind - v[branches.end]) / branches.impedance + charging
    return np.asarray((behind * current.conj()).real, np.float64)


def outputs(system: System, work: Work, x: Floats) -> dict[str, float]:
    """Every output of a system by its name, after its equations have been evaluated at `x`."""
    case, sensors, average = system.case, system.plan.sensors, system.plan.average
    H = np.array([device.values["H"] for device in case.devices["machine"]])
    has_pss = [case.device("pss", unit) is not None for unit in case.units]
    signal = dict(zip(SIGNALS, work.signals, strict=True))
    of_units = {
        "speed": x[average.omega],
        "delta": x[system.delta],
        "vt": np.abs(work.v[case.unit_bus]),
        **{name: signal[name] for name in ("Efd", "Ifd", "Pe", "Pm")},
        "pss": np.where(has_pss, signal["v_s"], 0.0),
    }
    of_buses = {"v_pu": np.abs(work.v), "theta": np.angle(work.v)}
    buses = [f"B{number}" for number in case.buses.number]
    pmus = [buses[bus] for bus in system.sensor_bus]
    tables = [
        *((name, case.units, row) for name, row in of_units.items()),
        *((name, buses, row) for name, row in of_buses.items()),
        ("f_hz", pmus, frequencies(sensors, x)),
        ("p_pu", case.branches.name, flows(case, work.v)),
    ]
    named = {
        f"{name}.{element}": value
        for name, elements, row in tables
        for element, value in zip(elements, row, strict=True)
    }
    coi = np.average(x[average.omega], weights=H * case.unit_MVA)
    return {**named, "coi": coi, "wbar": average_now(average, sensors, x)}


def sample(system: System, plan: Plan, work: Work, x: Floats) -> Floats:
    """The derivatives of all states, then all outputs."""
    dx = np.zeros_like(x)
    assert rhs(system.functions, plan, work, x, dx)
    return np.concatenate([dx, list(outputs(system, work, x).values())])


def copy_of_work(system: System) -> Work:
    """What the equations write, to be spoiled."""
    return Work._make(array.copy() for array in system.work)


def by_states(system: System, plan: Plan) -> tuple[Floats, Floats]:
    """A and C, the derivatives of all derivatives and of all outputs with every state."""
    work, n = copy_of_work(system), len(system.x0)
    columns = []
    for place in range(n):
        sides = []
        for sign in (1.0, -1.0):
            x = system.x0.copy()
            x[place] += sign * MOVE
            sides.append(sample(system, plan, work, x))
        columns.append((sides[0] - sides[1]) / (2 * MOVE))
    both = np.stack(columns, axis=1)
    return both[:n], both[n:]


def by_inputs(system: System, names: Sequence[str]) -> tuple[Floats, Floats]:
    """B and D, the same with each input.

    A power is drawn by a shunt, which to first order is the same as a load of any kind. `vs` moves
    what an exciter gets, so its unit must have no stabiliser that would write it anew.
    """
    n, columns = len(system.x0), []
    for name in names:
        move = DRAWN if name.partition(".")[0] in ("p_load", "q_load") else MOVE
        up, down = (_moved(system, name, sign * move) for sign in (1.0, -1.0))
        columns.append((up - down) / (2 * move))
    both = np.stack(columns, axis=1)
    return both[:n], both[n:]


def _moved(system: System, name: str, move: float) -> Floats:
    """The sample with one input moved."""
    quantity, element = name.split(".")
    plan, work = system.plan, copy_of_work(system)
    if quantity in ROWS:
        unit = system.case.units.index(element)
        assert quantity != "vs" or system.case.device("pss", element) is None
        plan = held(plan) if quantity == "wbar" else plan
        work.signals[SIGNALS.index(ROWS[quantity]), unit] += move
    else:
        bus = system.case.bus_index(int(element.removeprefix("B")))
        power = move if quantity == "p_load" else 1j * move
        shunt = complex(np.conj(power) / abs(work.v[bus]) ** 2)
        plan = system.after(NetworkState(shunts={"probe": (bus, shunt)}))
    return sample(system, plan, work, system.x0)
