"""A case at an operating point, assembled for integration: states, signals and the plan."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.by_address import first_class
from tieline.errors import NumericalError
from tieline.grid.case import Case
from tieline.grid.devices import Group, groups
from tieline.grid.equations import rhs
from tieline.grid.initialise import initial_states, require_rest
from tieline.grid.loads import frequency_buses, load_currents, load_network, nominal_admittance
from tieline.grid.models.base import SIGNALS, SIGNATURE, Equation, Machine, Model
from tieline.grid.network import factorise
from tieline.grid.plan import ROTORS, SENSORS, Average, Jobs, Plan, Work
from tieline.grid.powerflow import PowerFlow
from tieline.grid.sensors import Sensors
from tieline.grid.topology import NetworkState, network_matrix, scaled_loads

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class System:
    """A case ready to integrate.

    Attributes:
        functions: the compiled equations that the plan's jobs name.
        x0: (n,) states at rest, named by `labels` such as `omega.G1` or `z2.B61`.
        work: signals and voltages at rest.
        sensor_bus: (sensors,) bus indices; delta: (units,) places of the rotor angles in x.
    """

    case: Case
    flow: PowerFlow
    groups: tuple[Group, ...]
    functions: Any
    plan: Plan
    x0: Floats
    labels: tuple[str, ...]
    work: Work
    sensor_bus: Integers
    delta: Integers

    def after(self, state: NetworkState) -> Plan:
        """Return the plan whose network is what events have made of it.

        Raises:
            NumericalError: the network's equations have no unique solution.
        """
        pmus = self.plan.sensors.pmus
        parts = _network(self.case, self.flow, self.plan.unit_admittance, state, pmus)
        return self.plan._replace(**parts)


def build_system(
    case: Case,
    flow: PowerFlow,
    sensors: Sequence[int],
    average: Average | None = None,
    substitute: Mapping[type[Model], type[Model]] | None = None,
) -> System:
    """Return the system of a case at its operating point, checked to be at rest.

    Args:
        case: with the stabilisers of the experiment (`devices.with_pss`).
        flow: its solved power flow.
        sensors: bus numbers that carry a PMU.
        average: how wbar is formed; by default the equal mean of the sensors, undelayed.
        substitute: models to put in place of others, for experiments with equations.

    Raises:
        NumericalError: a limit is violated at the start, the network has no solution, or the
            system is not at rest.
    """
    found = groups(case, substitute or {})
    states, signals = initial_states(case, flow, found)
    x0_of = np.cumsum([0] + [state.size for state in states])
    sensor_bus = np.array([case.bus_index(number) for number in sensors], np.int64)
    filtered = np.concatenate([sensor_bus, frequency_buses(case)])
    f0_Hz = float(case.base.frequency_Hz)
    filters = Sensors(filtered, int(x0_of[-1]), f0_Hz, len(sensor_bus))
    angles = np.concatenate([flow.theta[filtered], np.zeros(len(filtered))])
    jobs, functions = _jobs(found, x0_of)
    omega = _places(found, x0_of, len(case.units), "omega")
    if average is None:
        average = sensor_average(np.ones(len(sensors)))
    machine = _machine_admittance(case, found)
    plan = Plan(
        jobs=jobs,
        unit_bus=case.unit_bus,
        unit_admittance=machine,
        **_network(case, flow, machine, NetworkState(), len(sensor_bus)),
        sensors=filters,
        average=average._replace(omega=omega),
        frozen=np.zeros(0, np.int64),
    )
    system = System(
        case=case,
        flow=flow,
        groups=tuple(found),
        functions=functions,
        plan=plan,
        x0=np.concatenate([*(state.ravel() for state in states), angles]),
        labels=_labels(case, found, sensors),
        work=_work(flow, signals, jobs, len(case.loads.bus)),
        sensor_bus=sensor_bus,
        delta=_places(found, x0_of, len(case.units), "delta"),
    )
    dx = np.zeros_like(system.x0)
    if not rhs(system.functions, plan, system.work, system.x0, dx):
        raise NumericalError("the load currents did not converge at the start")
    require_rest(dx, system.labels)
    return system


def sensor_average(weights: Floats, delay_steps: int = 0, mode: int = SENSORS) -> Average:
    """Return the weighted mean of the sensors, formed at every step and `delay_steps` late."""
    no_places, no_shares = np.zeros(0, np.int64), np.zeros((0, 0))
    return Average(mode, weights / weights.sum(), no_places, delay_steps, no_shares)


def rotor_average(weights: Floats, delay_steps: int = 0) -> Average:
    """Return the weighted mean of the rotor speeds, one weight a unit."""
    return sensor_average(weights, delay_steps, ROTORS)._replace(share=np.diag(weights))


def _schedule(found: Sequence[Group]) -> tuple[list[tuple[int, Equation]], int]:
    """Return (group, equation) in the order of evaluation, and how many precede the network."""
    machines = [(at, g.model) for at, g in enumerate(found) if issubclass(g.model, Machine)]
    sources = [(at, model.norton) for at, model in machines]
    terminals = [(at, eq) for at, model in machines for eq in model.equations[:-1]]
    controls = [
        (at, equation)
        for role in ("pss", "exciter", "governor")
        for at, group in enumerate(found)
        if group.role == role
        for equation in group.model.equations
    ]
    motions = [(at, model.equations[-1]) for at, model in machines]
    return [*sources, *terminals, *controls, *motions], len(sources)


def _jobs(found: Sequence[Group], x0_of: Integers) -> tuple[Jobs, Any]:
    schedule, before_network = _schedule(found)
    functions: list[Callable[..., None]] = []
    for _, equation in schedule:
        if equation.function not in functions:
            functions.append(equation.function)
    of = [found[at] for at, _ in schedule]
    p0_of = np.cumsum([0] + [group.p.size for group in found])

    def ragged(rows: list[list[int]]) -> tuple[Integers, Integers]:
        starts = np.cumsum([0] + [len(row) for row in rows])
        return starts.astype(np.int64), np.array([i for row in rows for i in row], np.int64)

    units_at, units = ragged([group.units.tolist() for group in of])
    inputs_at, inputs = ragged([[SIGNALS.index(n) for n in eq.inputs] for _, eq in schedule])
    outputs_at, outputs = ragged([[SIGNALS.index(n) for n in eq.outputs] for _, eq in schedule])
    whole = lambda values: np.array(list(values), np.int64)  # noqa: E731
    jobs = Jobs(
        function=whole(functions.index(eq.function) for _, eq in schedule),
        n=whole(len(group.units) for group in of),
        n_states=whole(len(group.model.states) for group in of),
        n_parameters=whole(len(group.model.parameters) for group in of),
        x0=whole(x0_of[at] for at, _ in schedule),
        p0=whole(p0_of[at] for at, _ in schedule),
        units_at=units_at,
        units=units,
        inputs_at=inputs_at,
        inputs=inputs,
        outputs_at=outputs_at,
        outputs=outputs,
        before_network=before_network,
        parameters=np.concatenate([group.p.ravel() for group in found]),
    )
    return jobs, first_class(functions, SIGNATURE)


def _network(
    case: Case,
    flow: PowerFlow,
    unit_admittance: NDArray[np.complex128],
    state: NetworkState,
    pmus: int,
) -> dict[str, Any]:
    """Return the network's part of a plan: factors, loads and their transfer."""
    machine = np.zeros(len(flow.v), np.complex128)
    np.add.at(machine, case.unit_bus, unit_admittance)
    load = nominal_admittance(case, flow)
    factors = factorise(network_matrix(case, state, load, machine, flow.v))
    loads = scaled_loads(load_currents(case, flow, pmus), state)
    settling = load_network(factors, loads)
    return {"factors": factors, "loads": loads, "load_network": settling}


def _machine_admittance(case: Case, found: Sequence[Group]) -> NDArray[np.complex128]:
    result = np.zeros(len(case.units), np.complex128)
    for group in found:
        if issubclass(group.model, Machine):
            rating = case.unit_MVA[group.units] / case.base.base_MVA
            result[group.units] = rating / group.model.impedance(group.p)
    return result


def _places(found: Sequence[Group], x0_of: Integers, units: int, state: str) -> Integers:
    places = np.zeros(units, np.int64)
    for at, group in enumerate(found):
        if issubclass(group.model, Machine):
            row = group.model.states.index(state)
            n = len(group.units)
            places[group.units] = x0_of[at] + row * n + np.arange(n)
    return places


def _labels(case: Case, found: Sequence[Group], sensors: Sequence[int]) -> tuple[str, ...]:
    filters = [f"B{bus}" for bus in sensors]
    filters += [f"load.B{case.buses.number[bus]}" for bus in frequency_buses(case)]
    names = [
        f"{state}.{case.units[unit]}"
        if group.role == "machine"
        else f"{group.role}.{state}.{case.units[unit]}"
        for group in found
        for state in group.model.states
        for unit in group.units
    ]
    return (*names, *(f"{state}.{place}" for state in ("z1", "z2") for place in filters))


def _work(flow: PowerFlow, signals: Floats, jobs: Jobs, loads: int) -> Work:
    largest = int(max(jobs.n)) * (len(SIGNALS) + 1)
    count = len(flow.v)
    return Work(
        signals=signals,
        v=flow.phasor,
        source=np.zeros(count, np.complex128),
        scratch=np.zeros((2, count), np.complex128),
        load_factor=np.ones((2, loads)),
        u=np.zeros(largest),
        y=np.zeros(largest),
    )
