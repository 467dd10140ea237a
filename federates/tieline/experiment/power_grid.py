"""Hands a case's tables to the generators of topologies, which know nothing of the grid's code."""

from tieline.grid.case import Case, load_case
from tieline.grid.check import controllers
from tieline.network.topologies.power_grid import Branch, Bus, PowerGrid
from tieline.resources import case_folder


def power_grid(case: str) -> PowerGrid:
    """Return what a communication network needs to know of a shipped case, or one in a folder.

    Args:
        case: a shipped name, or the path of a case folder.

    Raises:
        InputError: there is no such case, or its tables are faulty.
    """
    return power_grid_of(load_case(case_folder(case)))


def power_grid_of(found: Case) -> PowerGrid:
    """Return what a communication network needs to know of a case that has been read."""
    buses, branches = found.buses, found.branches
    numbers = buses.number.tolist()
    return PowerGrid(
        name=found.name,
        base_mva=found.base.base_MVA,
        areas=found.base.areas,
        buses=tuple(
            Bus(number, kv, area)
            for number, kv, area in zip(numbers, buses.base_kV.tolist(), buses.area, strict=True)
        ),
        branches=tuple(
            Branch(numbers[start], numbers[end], z.real, z.imag, kind)
            for start, end, z, kind in zip(
                branches.start, branches.end, branches.impedance.tolist(), branches.kind,
                strict=True,
            )
        ),
        pmus=found.base.sensors,
        controllers=controllers(found),
    )  # fmt: skip
