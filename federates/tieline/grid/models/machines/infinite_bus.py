"""The infinite bus: a voltage of constant size, angle and frequency."""

from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tieline.grid.models.base import Array, Equation, Machine, Parameter, indices
from tieline.grid.models.machines.classical import STATES, Classical, norton
from tieline.grid.models.park import current_behind

PARAMETERS = (
    Parameter("ra", "pu", "resistance behind which the voltage stands", at_least=0),
    Parameter("x", "pu", "reactance behind which the voltage stands; small", above=0),
)

P = indices(PARAMETERS)


def electrical(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write terminal power, the voltage's size as field current, and terminal current."""
    y[2], y[3] = current_behind(u[2], u[3], u[0], u[1], p[P.ra], p[P.x])
    y[0] = u[0] * y[2] + u[1] * y[3]
    y[1] = u[4]


def motion(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the derivatives of the rotor: none."""
    dx[:] = 0.0


class InfiniteBus(Machine):
    """A voltage that nothing moves, behind a small r_a + j x.

        E = |E| exp(j delta),     d|E|/dt = 0,     ddelta/dt = 0,     omega = 1

    Current out of it is positive. Its base is the unit's MVA, so that a large one makes a small
    impedance smaller still. It has no inertia constant: H counts as 0, which leaves it out of the
    centre of inertia and of every average of rotor speeds, where an infinite one would hold them at
    1. It carries no controls. Not modelled: everything else.
    """

    key = "infinite_bus"
    source = "Kundur 1994, section 12.3"
    parameters = PARAMETERS
    states = STATES
    controls = frozenset()
    example = MappingProxyType({"ra": 0.0, "x": 0.001})
    example_source = "typical values"
    norton = Equation(norton, ("Efd",), ("Epp_re", "Epp_im", "omega", "delta"))
    equations = (
        Equation(
            electrical, ("v_re", "v_im", "Epp_re", "Epp_im", "Efd"), ("Pe", "Ifd", "i_re", "i_im")
        ),
        Equation(motion, (), ()),
    )

    @classmethod
    def impedance(cls, p: Array) -> NDArray[np.complex128]:
        """Return (n,) r_a + j x."""
        return p[P.ra] + 1j * p[P.x]

    @classmethod
    def inertia(cls, p: Array) -> Array:
        """Return (n,) zeros: it takes no part in any average of speeds."""
        return np.zeros(p.shape[1])

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the angle at rest, from terminal voltage and current (`i_re`, `i_im`)."""
        padded = np.array([np.ones_like(p[P.x]), np.zeros_like(p[P.x]), p[P.ra], p[P.x]])
        return Classical.initialise(signals, padded)
