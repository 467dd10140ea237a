"""The compiled integrator's view of a system: flat arrays, and a list of jobs in their order."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.grid.loads import LoadCurrents, LoadNetwork
from tieline.grid.network import Factors
from tieline.grid.sensors import Sensors

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]

HELD, SENSORS, ROTORS = 0, 1, 2
"""Where wbar comes from: what was delivered, the sensors now, the rotors now."""


class Jobs(NamedTuple):
    """One job is one equation of one model for all of its units.

    Attributes:
        function: (jobs,) index into the tuple of compiled equations.
        n, n_states, n_parameters: (jobs,) sizes; x0, p0: (jobs,) places in x and `parameters`.
        units_at, units: units of job j are units[units_at[j] : units_at[j + 1]].
        inputs_at, inputs, outputs_at, outputs: signal rows, in the same form.
        before_network: how many jobs come before the network is solved.
        parameters: the parameter blocks (n_parameters, n), flattened, one after the other.
    """

    function: Integers
    n: Integers
    n_states: Integers
    n_parameters: Integers
    x0: Integers
    p0: Integers
    units_at: Integers
    units: Integers
    inputs_at: Integers
    inputs: Integers
    outputs_at: Integers
    outputs: Integers
    before_network: int
    parameters: Floats


class Average(NamedTuple):
    """How wbar is formed inside the equations.

    Attributes:
        mode: `HELD`, `SENSORS` or `ROTORS`.
        weight: (sensors,) or (units,), sum 1.
        omega: (units,) places of the rotor speeds in x.
        delay_steps: whole steps by which the average is late; 0 when it is not.
        share: (members, units) what each unit adds to each weight, to be taken out with it; (0, 0)
            when the weights do not depend on units.
    """

    mode: int
    weight: Floats
    omega: Integers
    delay_steps: int
    share: Floats


class Plan(NamedTuple):
    """Everything that the right-hand side reads; an event replaces it as a whole.

    Attributes:
        unit_bus: (units,) bus index; unit_admittance: (units,) Norton admittance, system base.
        load_network: what the loads settle with these factors.
        frozen: places in x of states that an event has stopped.
    """

    jobs: Jobs
    unit_bus: Integers
    unit_admittance: Complexes
    factors: Factors
    loads: LoadCurrents
    load_network: LoadNetwork
    sensors: Sensors
    average: Average
    frozen: Integers


class Work(NamedTuple):
    """What the right-hand side writes and reuses: signals (signals, units), voltages (buses,).

    `load_factor` (2, loads) is what frequency makes of the active and reactive power of loads.
    """

    signals: Floats
    v: Complexes
    source: Complexes
    scratch: Complexes
    load_factor: Floats
    u: Floats
    y: Floats
