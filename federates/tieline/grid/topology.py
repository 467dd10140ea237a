"""The network as events have left it: open branches, shunts, load factors, and its islands."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray

from tieline.grid.case import Case
from tieline.grid.loads import LoadCurrents
from tieline.grid.network import admittance, islands

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

FAULT_SUSCEPTANCE_PU = 1e7
"""A bolted three-phase fault, as an inductive shunt."""


@dataclass(frozen=True)
class NetworkState:
    """What events have changed.

    Attributes:
        is_open: rows of the branches that are open.
        shunts: added shunts by a name of their own: (bus index, admittance on the system base).
        load_factor: factor on the load of a bus index; 1 where none is given.
        extra_load: power that a bus index draws beyond its load, pu: HVDC modulation.
    """

    is_open: frozenset[int] = frozenset()
    shunts: Mapping[str, tuple[int, complex]] = field(default_factory=dict)
    load_factor: Mapping[int, float] = field(default_factory=dict)
    extra_load: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Change:
    """What one event does at one tick.

    Attributes:
        text: what happens, in words.
        opens, closes: rows of branches.
        shunts: shunts to add by name, or None to take the one of that name away.
        load_factor, extra_load: new values by bus index; `extra_load` adds to what there is.
        references: additions to signals: (signal, unit row, change).
        blocked: rows of units whose governor stops.
    """

    text: str
    opens: frozenset[int] = frozenset()
    closes: frozenset[int] = frozenset()
    shunts: Mapping[str, tuple[int, complex] | None] = field(default_factory=dict)
    load_factor: Mapping[int, float] = field(default_factory=dict)
    extra_load: Mapping[int, float] = field(default_factory=dict)
    references: tuple[tuple[str, int, float], ...] = ()
    blocked: frozenset[int] = frozenset()

    @property
    def is_of_network(self) -> bool:
        """Return whether the network's equations change."""
        parts = (self.opens, self.closes, self.shunts, self.load_factor, self.extra_load)
        return any(parts)


def changed(state: NetworkState, change: Change) -> NetworkState:
    """Return the state after a change."""
    shunts = {**state.shunts}
    for name, shunt in change.shunts.items():
        if shunt is None:
            shunts.pop(name, None)
        else:
            shunts[name] = shunt
    extra = {**state.extra_load}
    for bus, power in change.extra_load.items():
        extra[bus] = extra.get(bus, 0.0) + power
    return replace(
        state,
        is_open=(state.is_open | change.opens) - change.closes,
        shunts=shunts,
        load_factor={**state.load_factor, **change.load_factor},
        extra_load=extra,
    )


def live_buses(case: Case, state: NetworkState) -> NDArray[np.bool_]:
    """Return (buses,) whether a bus is in an island that holds a unit."""
    live = np.zeros(len(case.buses.number), dtype=bool)
    sources = set(case.unit_bus.tolist())
    for island in islands(case.branches, len(live), state.is_open):
        live[island] = bool(sources & set(island.tolist()))
    return live


def units_in_service(case: Case, state: NetworkState) -> NDArray[np.bool_]:
    """Return (units,) whether a unit is part of the largest island."""
    parts = islands(case.branches, len(case.buses.number), state.is_open)
    main = max(parts, key=len)
    return np.isin(case.unit_bus, main)


def scaled_loads(loads: LoadCurrents, state: NetworkState) -> LoadCurrents:
    """Return the load currents with the state's factors and extra power in them.

    Extra power is drawn as constant current: it scales the terminal's own.
    """
    factor = np.array([state.load_factor.get(bus, 1.0) for bus in loads.bus.tolist()])
    p0 = loads.p0 * factor + [state.extra_load.get(bus, 0.0) for bus in loads.bus.tolist()]
    q0 = loads.q0 * factor
    return loads._replace(p0=p0, q0=q0, admittance=(p0 - 1j * q0) / loads.v0**2)


def network_matrix(
    case: Case, state: NetworkState, load: Complexes, machine: Complexes, v0: Floats
) -> sparse.csc_matrix:
    """Return (n, n) the bus admittances of a state, system base.

    A dead island's buses keep a unit admittance to ground alone: their voltage is zero.

    Args:
        case: the interconnection.
        state: what events have changed.
        load: (n,) nominal load admittances of the untouched case.
        machine: (n,) Norton admittances of the units.
        v0: (n,) initial voltage magnitudes.
    """
    factor = np.array([state.load_factor.get(bus, 1.0) for bus in range(len(load))])
    diagonal = load * factor + machine
    for bus, power in state.extra_load.items():
        diagonal[bus] += power / v0[bus] ** 2
    for bus, shunt in state.shunts.values():
        diagonal[bus] += shunt
    matrix = admittance(case.buses, case.branches, state.is_open) + sparse.diags(diagonal)
    live = live_buses(case, state)
    if not live.all():
        keep = sparse.diags(live.astype(float))
        matrix = keep @ matrix @ keep + sparse.diags((~live).astype(float))
    return matrix.tocsc()
