"""A whole system linearised at its operating point.

    dx/dt = A x + B u,   y = C x + D u

is put together from every block's own derivatives (`differences.py`) and the network's
(`network.py`). What joins the blocks stays in sight: the voltages, the average `wbar` and the
stabilisers' outputs are eliminated one after the other, so that the loop through the average can be
left open, delayed sensor by sensor, or closed, and a stabiliser can be cut from its exciter.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import rsf2csf, schur

from tieline.compiled import compiled
from tieline.errors import InputError
from tieline.grid.blocks import EMPTY, Blocks, cut
from tieline.grid.models.base import SIGNALS
from tieline.grid.system import System
from tieline.grid.tables import near
from tieline.linear.differences import (
    INPUTS,
    PSS_OUT,
    V_IM,
    V_RE,
    V_S_IN,
    WBAR,
    Local,
    local_derivatives,
)
from tieline.linear.names import (
    BUS_INPUTS,
    PMU_OUTPUT,
    UNIT_INPUTS,
    UNIT_OUTPUTS,
    average_rows,
    bus_row,
    centre_of_inertia_row,
    input_names,
    output_names,
    pmu_row,
    unit_row,
    voltage_part,
)
from tieline.linear.network import NetworkDerivatives, network_derivatives, voltages_for

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LinearSystem:
    """A system at its operating point, to first order.

    Attributes:
        system: what was linearised.
        blocks: its states by block.
        local: the blocks' derivatives.
        network: the network's.
        severed: (units,) stabilisers whose output does not reach their exciter.
        average_rows: (members, n) what each member of the average (a PMU's frequency or a rotor's
            speed, in pu) is of the states; `average_weights` (members,) its share.
    """

    system: System
    blocks: Blocks
    local: Local
    network: NetworkDerivatives
    severed: NDArray[np.bool_]
    average_rows: Floats
    average_weights: Floats

    @property
    def states(self) -> tuple[str, ...]:
        """Return the names of the states, such as `omega.G1`."""
        return self.system.labels

    @property
    def inputs(self) -> tuple[str, ...]:
        """Return the names of all inputs, such as `Vref.G1` or `p_load.B61`."""
        return input_names(self.system)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Return the names of all outputs, such as `speed.G1`, `v_pu.B61`, `p_pu.60-61`, `coi`."""
        return output_names(self.system)

    @cached_property
    def A(self) -> Floats:
        """Return (n, n) the state matrix with the average undelayed."""
        average = self.average_weights @ self.average_rows
        members = np.flatnonzero(average)
        A = self._assembled()
        A[:, members] += np.outer(self.by_average, average[members])
        return A

    @cached_property
    def A_without_average(self) -> Floats:
        """Return (n, n) the state matrix when every stabiliser believes a constant average."""
        return self._assembled()

    def _assembled(self) -> Floats:
        """Return the matrix anew: a copy of one that is kept would cost more, and its memory."""
        A = np.zeros((len(self.states), len(self.states)))
        _assemble(self.blocks, *self._with_stabilisers, self._felt, self._block_voltages, A)
        return A

    @cached_property
    def triangular(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return T and Q (n, n) with A_without_average = Q T Q^H, T upper triangular."""
        triangle, unitary = rsf2csf(*schur(self.A_without_average))
        return np.ascontiguousarray(triangle), unitary

    @cached_property
    def by_average(self) -> Floats:
        """Return (n,) dx/dt for one average that every stabiliser believes."""
        return self.by_believed.sum(axis=1)

    @cached_property
    def by_believed(self) -> Floats:
        """Return (n, units) dx/dt for the average that each unit's stabiliser believes."""
        _, by_input = self._with_stabilisers
        unit, slot = self._slots
        result = np.zeros((len(self.states), self.blocks.units))
        result[self.blocks.place[unit, slot], unit] = by_input[unit, slot, WBAR]
        return result

    @cached_property
    def _with_stabilisers(self) -> tuple[Floats, Floats]:
        """Return `Local.by_state` and `by_input` with each exciter joined to its stabiliser."""
        local, units = self.local, self.blocks.units
        through = np.where(self.severed[:, None], 0.0, local.by_input[:units, :, V_S_IN])
        by_state, by_input = local.by_state.copy(), local.by_input.copy()
        by_state[:units] += through[:, :, None] * local.signals_by_state[PSS_OUT][:, None, :]
        by_input[:units] += through[:, :, None] * local.signals_by_input[PSS_OUT][:, None, :]
        return by_state, by_input

    @cached_property
    def _slots(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return unit and slot in its block of every state of the units."""
        units, slots = np.nonzero(self.blocks.place[: self.blocks.units] != EMPTY)
        return units, slots

    def B(self, inputs: Sequence[str]) -> Floats:
        """Return (n, inputs) the input matrix.

        Raises:
            InputError: there is no such input.
        """
        z, _ = self._local_inputs(inputs)
        result = np.zeros((len(self.states), len(inputs)))
        for b, size in enumerate(self.blocks.size):
            result[self.blocks.place[b, :size]] = self.local.by_input[b, :size] @ z[b]
        return result

    def C(self, outputs: Sequence[str]) -> Floats:
        """Return (outputs, n) the output matrix, with the average undelayed.

        Raises:
            InputError: there is no such output.
        """
        rows, believed = self._output_rows(outputs)
        return rows + np.outer(believed, self.average_weights @ self.average_rows)

    def C_without_average(self, outputs: Sequence[str]) -> tuple[Floats, Floats]:
        """Return (outputs, n) and (outputs,): outputs by the states, and by the average."""
        return self._output_rows(outputs)

    def D(self, outputs: Sequence[str], inputs: Sequence[str]) -> Floats:
        """Return (outputs, inputs) the feedthrough, with the average undelayed.

        Raises:
            InputError: there is no such output or input.
        """
        z, v = self._local_inputs(inputs)
        result = np.zeros((len(outputs), len(inputs)))
        for row, name in enumerate(outputs):
            quantity, _, element = name.partition(".")
            if quantity in UNIT_OUTPUTS or quantity == "pss":
                at, unit = self._signal_row(quantity), unit_row(self.system, name, element)
                result[row] = self.local.signals_by_input[at, unit] @ z[unit]
            else:
                result[row] = voltage_part(self.system, name) @ v
        return result

    @cached_property
    def _ports(self) -> Floats:
        """Return (2 buses, 2 units + filters) dV for each unit's source and each filter's state."""
        currents = [self.network.by_source.toarray(), self.network.by_filter.toarray()]
        return voltages_for(self.network, np.concatenate(currents, axis=1))

    @cached_property
    def _port_states(self) -> Floats:
        """Return (2 units + filters, n) what sources and filters are of the states."""
        blocks, sensors = self.blocks, self.system.plan.sensors
        count = len(sensors.bus)
        rows = np.zeros((2 * blocks.units + count, len(self.states)))
        unit, slot = self._slots
        for axis, name in enumerate(("Epp_re", "Epp_im")):
            by_state = self.local.signals_by_state[SIGNALS.index(name)]
            rows[2 * unit + axis, blocks.place[unit, slot]] = by_state[unit, slot]
        filters = np.arange(count)
        rows[2 * blocks.units + filters, sensors.x0 + count + filters] = 1.0
        return rows

    @cached_property
    def _felt(self) -> NDArray[np.intp]:
        """Return (k,) the places of the states that sources and filters are made of."""
        return np.flatnonzero(self._port_states.any(axis=0))

    @cached_property
    def _block_voltages(self) -> Floats:
        """Return (blocks, 2, k) dV of each block's bus for the states of `_felt`."""
        bus = self.blocks.bus
        rows = np.stack([2 * bus, 2 * bus + 1], axis=1).ravel()
        ports = self._ports[rows] @ self._port_states[:, self._felt]
        return ports.reshape(len(bus), 2, -1)

    @cached_property
    def _v_s(self) -> Floats:
        """Return (units, n) what each exciter gets from its stabiliser, the average held."""
        return np.where(self.severed[:, None], 0.0, self._signal_states(PSS_OUT))

    def _signal_states(self, row: int) -> Floats:
        """Return (units, n) a signal of every unit, with the exciters' input and wbar held."""
        blocks, units = self.blocks, self.blocks.units
        of_voltage = self.local.signals_by_input[row][:, [V_RE, V_IM]]
        result = np.zeros((units, len(self.states)))
        result[:, self._felt] = np.einsum("ui,uik->uk", of_voltage, self._block_voltages[:units])
        unit, slot = self._slots
        result[unit, blocks.place[unit, slot]] += self.local.signals_by_state[row, unit, slot]
        return result

    def _signal_row(self, quantity: str) -> int:
        return PSS_OUT if quantity == "pss" else SIGNALS.index(UNIT_OUTPUTS[quantity])

    def _output_rows(self, outputs: Sequence[str]) -> tuple[Floats, Floats]:
        rows = np.zeros((len(outputs), len(self.states)))
        believed = np.zeros(len(outputs))
        known: dict[int, Floats] = {}
        for row, name in enumerate(outputs):
            quantity, _, element = name.partition(".")
            if quantity in UNIT_OUTPUTS or quantity == "pss":
                at, unit = self._signal_row(quantity), unit_row(self.system, name, element)
                known.setdefault(at, self._signal_states(at))
                by_input = self.local.signals_by_input[at, unit]
                rows[row] = known[at][unit] + by_input[V_S_IN] * self._v_s[unit]
                believed[row] = by_input[WBAR] + by_input[V_S_IN] * self._v_s_by_wbar[unit]
            elif name == "wbar":
                believed[row] = 1.0
            elif name == "coi":
                rows[row] = centre_of_inertia_row(self.system)
            elif quantity == PMU_OUTPUT:
                sensors = self.system.plan.sensors
                at = pmu_row(self.system, name, element)
                rows[row, sensors.x0 + len(sensors.bus) + at] = 1.0 / (2.0 * np.pi)
            else:
                part = voltage_part(self.system, name)
                rows[row] = (part @ self._ports) @ self._port_states
        return rows, believed

    @cached_property
    def _v_s_by_wbar(self) -> Floats:
        """Return (units,) what each exciter gets at once when its unit's average moves."""
        direct = self.local.signals_by_input[PSS_OUT][:, WBAR]
        return np.where(self.severed, 0.0, direct)

    def _local_inputs(self, inputs: Sequence[str]) -> tuple[Floats, Floats]:
        """Return (blocks, INPUTS, inputs) what inputs do at once locally, and to V (2 buses)."""
        case, blocks = self.system.case, self.blocks
        z = np.zeros((len(blocks.bus), INPUTS, len(inputs)))
        currents = np.zeros((2 * len(case.buses.number), len(inputs)))
        for column, name in enumerate(inputs):
            quantity, _, element = name.partition(".")
            if quantity in UNIT_INPUTS:
                z[unit_row(self.system, name, element), UNIT_INPUTS[quantity], column] = 1.0
            elif quantity in BUS_INPUTS:
                bus = bus_row(self.system, name, element)
                power = 1.0 if quantity == "p_load" else 1.0j
                drawn = np.conj(power / self.system.work.v[bus])
                currents[2 * bus, column], currents[2 * bus + 1, column] = -drawn.real, -drawn.imag
            else:
                raise InputError(f"no input '{name}'{near(name, list(self.inputs))}")
        v = voltages_for(self.network, currents)
        z[:, V_RE], z[:, V_IM] = v[2 * blocks.bus], v[2 * blocks.bus + 1]
        given = np.einsum("ui,uik->uk", self.local.signals_by_input[PSS_OUT], z[: blocks.units])
        z[: blocks.units, V_S_IN] += np.where(self.severed[:, None], 0.0, given)
        return z, v


@compiled
def _assemble(
    blocks: Blocks,
    by_state: Floats,
    by_input: Floats,
    felt: NDArray[np.intp],
    block_voltages: Floats,
    A: Floats,
) -> None:
    """Write A (n, n): each block by its own states and, through its voltage, by those felt."""
    for b in range(len(blocks.bus)):
        place = blocks.place[b, : blocks.size[b]]
        for slot, row in enumerate(place):
            by_re, by_im = by_input[b, slot, V_RE], by_input[b, slot, V_IM]
            for k, column in enumerate(felt):
                A[row, column] = by_re * block_voltages[b, 0, k] + by_im * block_voltages[b, 1, k]
            for other, column in enumerate(place):
                A[row, column] += by_state[b, slot, other]


def linearise(system: System, cut_pss: Collection[str] = ()) -> LinearSystem:
    """Return a system to first order around its operating point.

    Args:
        system: at rest.
        cut_pss: units whose stabiliser is cut from its exciter; its output can still be looked at.

    Raises:
        InputError: there is no such unit.
    """
    case, plan = system.case, system.plan
    for unit in cut_pss:
        if unit not in case.units:
            raise InputError(f"no unit '{unit}'{near(unit, list(case.units))}")
    blocks = cut(plan, len(system.x0))
    local = local_derivatives(system.functions, plan, system.work, blocks, system.x0)
    return LinearSystem(
        system=system,
        blocks=blocks,
        local=local,
        network=network_derivatives(system),
        severed=np.isin(case.units, list(cut_pss)),
        average_rows=average_rows(system),
        average_weights=plan.average.weight,
    )
