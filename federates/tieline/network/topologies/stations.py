"""Groups buses into substations, and finds the transmission corridors between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

from tieline.errors import InputError
from tieline.network.parts import parts_of
from tieline.network.topologies.power_grid import Branch, Bus, PowerGrid

SITE_REACTANCE_PU = 0.0011
"""A branch of at most this reactance is a connection inside a substation; so is a negative one,
which stands for a series capacitor bank."""

OHM_PER_KM = {230.0: 0.488, 345.0: 0.367, 500.0: 0.325, 765.0: 0.329}
"""Typical lines by voltage, kV: P. Kundur, Power System Stability and Control (1994), table 6.1."""


@dataclass(frozen=True)
class Station:
    """A substation: its name, its buses in rising order, and the area of the bus that names it."""

    name: str
    buses: tuple[int, ...]
    area: str = ""


@dataclass(frozen=True)
class Corridor:
    """A way of transmission lines between two stations, as long as its shortest circuit."""

    a: str
    b: str
    km: float


def is_inside_a_station(branch: Branch) -> bool:
    """Return whether a branch joins two buses of one substation.

    Transformers without resistance do; one with resistance stands for lines as well.
    """
    is_transformer = "transformer" in branch.kind and branch.resistance_pu == 0
    return is_transformer or branch.reactance_pu <= SITE_REACTANCE_PU


def stations_of(grid: PowerGrid) -> tuple[Station, ...]:
    """Return the substations of a grid in the order of their names.

    A station is named after the bus of its PMU, or else after its bus of highest voltage; of
    several the lowest number counts. Numbers are padded so that names sort as numbers do.
    """
    inside = (branch for branch in grid.branches if is_inside_a_station(branch))
    joined = ((branch.start, branch.end) for branch in inside)
    buses = {bus.number: bus for bus in grid.buses}
    width = max(3, len(str(max(buses))))
    stations = []
    for part in parts_of(buses, joined):
        members = sorted(part)
        first = _naming_bus([buses[number] for number in members], grid.pmus)
        stations.append(Station(f"S{first.number:0{width}d}", tuple(members), first.area))
    return tuple(sorted(stations, key=lambda station: station.name))


def _naming_bus(members: Sequence[Bus], pmus: Sequence[int]) -> Bus:
    measured = [bus for bus in members if bus.number in pmus]
    highest = max(bus.base_kv for bus in members)
    return (measured or [bus for bus in members if bus.base_kv == highest])[0]


def corridors_of(grid: PowerGrid, stations: Sequence[Station]) -> tuple[Corridor, ...]:
    """Return the corridors of a grid, as `lines_of`, if they join all its stations.

    Raises:
        InputError: the corridors do not join all stations.
    """
    found = lines_of(grid, stations)
    _refuse_islands(grid, stations, found)
    return found


def lines_of(grid: PowerGrid, stations: Sequence[Station]) -> tuple[Corridor, ...]:
    """Return the corridors of a grid in the order of their ends' names, one for each pair.

    A circuit's length is its reactance over that of a typical line of its voltage, the higher one
    of its ends.
    """
    kv = {bus.number: bus.base_kv for bus in grid.buses}
    station = {bus: found.name for found in stations for bus in found.buses}
    shortest: dict[tuple[str, str], float] = {}
    for branch in grid.branches:
        ends = sorted((station[branch.start], station[branch.end]))
        if ends[0] == ends[1] or is_inside_a_station(branch):
            continue
        pair = (ends[0], ends[1])
        km = _length_km(branch, max(kv[branch.start], kv[branch.end]), grid.base_mva)
        shortest[pair] = min(km, shortest.get(pair, km))
    return tuple(Corridor(a, b, km) for (a, b), km in sorted(shortest.items()))


def _length_km(branch: Branch, kv: float, base_mva: float) -> float:
    ohm = branch.reactance_pu * kv**2 / base_mva
    nearest = min(OHM_PER_KM, key=lambda known: max(known / kv, kv / known))
    return ohm / OHM_PER_KM[nearest]


def _refuse_islands(
    grid: PowerGrid, stations: Sequence[Station], corridors: Sequence[Corridor]
) -> None:
    names = [station.name for station in stations]
    parts = parts_of(names, [(corridor.a, corridor.b) for corridor in corridors])
    if len(parts) > 1:
        lost = [f"{', '.join(sorted(part)[:8])}{' ...' * (len(part) > 8)}" for part in parts[1:]]
        raise InputError(
            f"case '{grid.name}': no line joins {'; nor '.join(lost)} to the other "
            f"{len(parts[0])} stations, so no network can follow the lines"
        )


def unused_name(wanted: str, taken: set[str]) -> str:
    """Return a name that is not taken, with a number behind it if need be, and take it."""
    name = next(
        name for i in count(1) if (name := wanted if i == 1 else f"{wanted} ({i})") not in taken
    )
    taken.add(name)
    return name
