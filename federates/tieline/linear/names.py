"""What the inputs and outputs of a linear system are called, and what they are of the voltages."""

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.grid.average import inertia
from tieline.grid.plan import ROTORS
from tieline.grid.system import System
from tieline.grid.tables import near
from tieline.linear.differences import P_REF, V_REF, V_S_IN, W_0, WBAR

Floats = NDArray[np.float64]

UNIT_OUTPUTS = {
    "speed": "omega",
    "delta": "delta",
    "vt": "vt",
    "Efd": "Efd",
    "Ifd": "Ifd",
    "Pe": "Pe",
    "Pm": "Pm",
}
"""Outputs of a unit by the signals that they are; `pss` is what its stabiliser gives."""

UNIT_INPUTS = {"Vref": V_REF, "Pref": P_REF, "w0": W_0, "wbar": WBAR, "vs": V_S_IN}
"""Inputs of a unit: references, an error of the average, a signal added at its exciter."""

BUS_INPUTS = ("p_load", "q_load")
"""Power drawn at a bus beside its load, pu; a change of an HVDC terminal's order is one, too."""

BUS_OUTPUTS = ("v_pu", "theta")
PMU_OUTPUT = "f_hz"
SYSTEM_OUTPUTS = ("coi", "wbar")


def input_names(system: System) -> tuple[str, ...]:
    """Return the names of all inputs, such as `Vref.G1` or `p_load.B61`."""
    case = system.case
    of_units = [f"{name}.{unit}" for name in UNIT_INPUTS for unit in case.units]
    of_buses = [f"{name}.B{bus}" for name in BUS_INPUTS for bus in case.buses.number]
    return (*of_units, *of_buses)


def output_names(system: System) -> tuple[str, ...]:
    """Return the names of all outputs, such as `speed.G1`, `v_pu.B61`, `p_pu.60-61`, `coi`."""
    case, sensors = system.case, system.plan.sensors
    of_units = [f"{name}.{unit}" for name in (*UNIT_OUTPUTS, "pss") for unit in case.units]
    of_buses = [f"{name}.B{bus}" for name in BUS_OUTPUTS for bus in case.buses.number]
    pmus = case.buses.number[sensors.bus[: sensors.pmus]]
    of_pmus = [f"{PMU_OUTPUT}.B{bus}" for bus in pmus]
    of_branches = [f"p_pu.{name}" for name in case.branches.name]
    return (*of_units, *of_buses, *of_pmus, *of_branches, *SYSTEM_OUTPUTS)


def unit_row(system: System, name: str, element: str) -> int:
    """Return the row of the unit that a name ends with, or raise InputError."""
    units = system.case.units
    if element not in units:
        raise InputError(f"'{name}': no unit '{element}'{near(element, list(units))}")
    return units.index(element)


def bus_row(system: System, name: str, element: str) -> int:
    """Return the row of the bus that a name ends with, or raise InputError."""
    numbers = system.case.buses.number.tolist()
    if element[:1] != "B" or not element[1:].isdecimal() or int(element[1:]) not in numbers:
        known = [f"B{number}" for number in numbers]
        raise InputError(f"'{name}': no bus '{element}'{near(element, known)}")
    return numbers.index(int(element[1:]))


def pmu_row(system: System, name: str, element: str) -> int:
    """Return the place of the PMU that a name ends with, or raise InputError."""
    sensors = system.plan.sensors
    buses = sensors.bus[: sensors.pmus].tolist()
    bus = bus_row(system, name, element)
    if bus not in buses:
        raise InputError(f"'{name}': bus {element[1:]} has no PMU")
    return buses.index(bus)


def voltage_part(system: System, name: str) -> Floats:
    """Return (2 buses,) what an output is of the voltages; zeros for one that is of states.

    Raises:
        InputError: there is no such output.
    """
    quantity, _, element = name.partition(".")
    case, v = system.case, system.work.v
    part = np.zeros(2 * len(v))
    if quantity == PMU_OUTPUT:
        pmu_row(system, name, element)
        return part
    if name in SYSTEM_OUTPUTS:
        return part
    if quantity == "p_pu":
        branches = case.branches
        if element not in branches.name:
            raise InputError(f"no branch '{element}'{near(element, list(branches.name))}")
        at = branches.name.index(element)
        ends = (branches.start[at], branches.end[at])
        for bus, (by_re, by_im) in zip(ends, _flow_slopes(system, at), strict=True):
            part[2 * bus] += by_re
            part[2 * bus + 1] += by_im
        return part
    if quantity not in BUS_OUTPUTS:
        raise InputError(f"no output '{name}'{near(name, list(output_names(system)))}")
    bus = bus_row(system, name, element)
    size = abs(v[bus])
    if quantity == "v_pu":
        part[2 * bus], part[2 * bus + 1] = v[bus].real / size, v[bus].imag / size
    else:
        part[2 * bus], part[2 * bus + 1] = -v[bus].imag / size**2, v[bus].real / size**2
    return part


def centre_of_inertia_row(system: System) -> Floats:
    """Return (n,) the speed of the centre of inertia as a row over the states."""
    case, omega = system.case, system.plan.average.omega
    weight = case.unit_MVA * inertia(case)
    row = np.zeros(len(system.x0))
    row[omega] = weight / weight.sum()
    return row


def average_rows(system: System) -> Floats:
    """Return (members, n) the members of the average, pu, as rows over the states."""
    average, sensors = system.plan.average, system.plan.sensors
    members = len(average.weight)
    rows = np.zeros((members, len(system.x0)))
    if average.mode == ROTORS:
        rows[np.arange(members), average.omega] = 1.0
    else:
        z2 = sensors.x0 + len(sensors.bus)
        rows[np.arange(members), z2 + np.arange(members)] = 1.0 / (2.0 * np.pi * sensors.f0_Hz)
    return rows


def _flow_slopes(system: System, at: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return dP/d(re, im) of the voltages at both ends, for P into a branch at its `from` end."""
    branches, v = system.case.branches, system.work.v
    start, end, tap = branches.start[at], branches.end[at], branches.tap[at]
    series = 1.0 / branches.impedance[at]
    own = (series + 0.5j * branches.susceptance[at]) / abs(tap) ** 2
    across = -series / np.conj(tap)
    current = own * v[start] + across * v[end]
    # P = Re(V conj(I)); a step dV at one end moves V and I.
    near_end = [
        (step * np.conj(current) + v[start] * np.conj(own * step)).real for step in (1.0, 1.0j)
    ]
    far_end = [(v[start] * np.conj(across * step)).real for step in (1.0, 1.0j)]
    return (near_end[0], near_end[1]), (far_end[0], far_end[1])
