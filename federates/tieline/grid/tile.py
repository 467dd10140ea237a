"""A case repeated side by side: a larger system whose operating point is known, for benchmarks."""

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.grid.case import Branches, Buses, Case, Loads, branch_name
from tieline.grid.case_file import CaseFile
from tieline.grid.device_tables import Device
from tieline.grid.network import admittance
from tieline.grid.powerflow import PowerFlow, solve_power_flow

TIE_REACTANCE_PU = 0.02
"""A tie on the system base of 100 MVA: some 150 km of line at 500 kV."""

TIE_KIND = "tie of tiles"

Number = TypeVar("Number", np.float64, np.complex128)


def tiled(case: Case, times: int) -> Case:
    """Return a case that holds another several times, neighbouring tiles joined by ties.

    The tiles form a chain: at the strongest bus of each area (that with the largest self
    admittance among its buses without a unit), a lossless tie without charging leads to the same
    bus of the next tile. The tiles have equal voltages, so the ties carry nothing at the start.
    Only the first tile keeps its slack bus: in the others it holds voltage and gives the power that
    the power flow has found, which is also where the tiled power flow starts. A chain and not a
    ring, whose symmetry would have pairs of equal eigenvalues.

    The first tile keeps its names; in tile k, G1 is G1_k, area BC is BC_k, and to the numbers of
    buses (k - 1) times the power of ten above the largest is added.

    Args:
        case: what is repeated.
        times: how many tiles, at least 1.

    Raises:
        InputError: `times` is below 1, or an area has units at all of its buses.
        NumericalError: the case's power flow has no solution.
    """
    if times < 1:
        raise InputError(f"a case is tiled at least once (got {times})")
    flow = solve_power_flow(case)
    buses = _buses(case, flow, times)
    unit_bus = _shifted(case.unit_bus, len(case.buses.number), times)
    return Case(
        folder=case.folder,
        base=_base(case, times),
        buses=buses,
        branches=_branches(case, buses, times),
        loads=_loads(case, times),
        units=_named(case.units, times),
        unit_bus=unit_bus,
        unit_MVA=np.tile(case.unit_MVA, times),
        devices={role: _devices(devices, times) for role, devices in case.devices.items()},
    )


def strongest_buses(case: Case) -> NDArray[np.int64]:
    """Return the row of the bus of largest self admittance in each area, units' buses left out.

    Raises:
        InputError: an area has units at all of its buses.
    """
    size = np.abs(admittance(case.buses, case.branches).diagonal())
    size[case.unit_bus] = 0.0
    areas = np.array(case.buses.area)
    found = []
    for area in case.base.areas:
        here = np.flatnonzero((areas == area) & (size > 0))
        if not len(here):
            raise InputError(f"area '{area}' of case '{case.name}' has no bus without a unit")
        found.append(here[np.argmax(size[here])])
    return np.array(found, np.int64)


def _name(name: str, tile: int) -> str:
    return name if tile == 0 else f"{name}_{tile + 1}"


def _named(names: tuple[str, ...], times: int) -> tuple[str, ...]:
    return tuple(_name(name, tile) for tile in range(times) for name in names)


def _shifted(values: NDArray[np.int64], step: int, times: int) -> NDArray[np.int64]:
    return (values + step * np.arange(times)[:, None]).ravel()


def _number_step(case: Case) -> int:
    return int(10 ** len(str(case.buses.number.max())))


def _base(case: Case, times: int) -> CaseFile:
    sensors = _shifted(np.array(case.base.sensors), _number_step(case), times)
    changes = {
        "name": f"{case.name}_x{times}",
        "areas": _named(case.base.areas, times),
        "sensors": tuple(sensors.tolist()),
    }
    return case.base.model_copy(update=changes)


def _buses(case: Case, flow: PowerFlow, times: int) -> Buses:
    buses = case.buses
    p_gen = np.where(np.array(buses.kind) == "slack", flow.p_gen, buses.p_gen)
    others = tuple("pv" if kind == "slack" else kind for kind in buses.kind)
    start = replace(buses, v=flow.v, theta=flow.theta, p_gen=p_gen)
    repeated = {
        name: np.tile(value, times)
        for name, value in vars(start).items()
        if isinstance(value, np.ndarray)
    }
    repeated["number"] = _shifted(buses.number, _number_step(case), times)
    kind = buses.kind + others * (times - 1)
    return Buses(**repeated, kind=kind, area=_named(buses.area, times))


def _branches(case: Case, buses: Buses, times: int) -> Branches:
    branches, count = case.branches, len(case.buses.number)
    strong, joints = strongest_buses(case), times - 1
    ties = len(strong) * joints
    start = np.concatenate(
        [_shifted(branches.start, count, times), _shifted(strong, count, joints)]
    )
    end = np.concatenate(
        [_shifted(branches.end, count, times), _shifted(strong + count, count, joints)]
    )
    circuits = [int(name.partition("#")[2] or 1) for name in branches.name] * times + [1] * ties
    number = [str(bus) for bus in buses.number]
    names = tuple(
        branch_name(number[i], number[j], circuit)
        for i, j, circuit in zip(start, end, circuits, strict=True)
    )

    def with_ties(own: NDArray[Number], of_tie: Number) -> NDArray[Number]:
        return np.concatenate([np.tile(own, times), np.full(ties, of_tie)])

    return Branches(
        name=names,
        start=start,
        end=end,
        impedance=with_ties(branches.impedance, np.complex128(1j * TIE_REACTANCE_PU)),
        susceptance=with_ties(branches.susceptance, np.float64(0.0)),
        tap=with_ties(branches.tap, np.complex128(1.0)),
        kind=branches.kind * times + (TIE_KIND,) * ties,
    )


def _loads(case: Case, times: int) -> Loads:
    repeated = {name: np.tile(value, times) for name, value in vars(case.loads).items()}
    repeated["bus"] = _shifted(case.loads.bus, len(case.buses.number), times)
    return Loads(**repeated)


def _devices(devices: tuple[Device, ...], times: int) -> tuple[Device, ...]:
    return tuple(
        replace(device, unit=_name(device.unit, tile))
        for tile in range(times)
        for device in devices
    )
