"""The classical machine: a voltage of constant size behind the transient reactance."""

from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tieline.grid.models.base import Array, Equation, Machine, indices
from tieline.grid.models.machines.subtransient import PARAMETERS as SUBTRANSIENT
from tieline.grid.models.park import current_behind

PARAMETERS = tuple(item for item in SUBTRANSIENT if item.symbol in ("H", "D", "ra", "xd_p"))
STATES = ("delta", "omega")

P = indices(PARAMETERS)
X = indices(STATES)


def norton(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the voltage E' of the size `Efd` at the rotor's angle, speed and angle."""
    y[0] = u[0] * np.cos(x[X.delta])
    y[1] = u[0] * np.sin(x[X.delta])
    y[2] = x[X.omega]
    y[3] = x[X.delta]


def electrical(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write terminal power, field current (E' itself) and terminal current."""
    y[2], y[3] = current_behind(u[2], u[3], u[0], u[1], p[P.ra], p[P.xd_p])
    y[0] = u[0] * y[2] + u[1] * y[3]
    y[1] = u[4]


def motion(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the derivatives of the rotor (equations in the class docstring)."""
    gap_power = u[0] * u[2] + u[1] * u[3]
    slip = x[X.omega] - 1.0
    dx[X.delta] = u[5] * slip
    dx[X.omega] = ((u[4] - gap_power) / x[X.omega] - p[P.D] * slip) / (2.0 * p[P.H])


class Classical(Machine):
    """A voltage E' of constant size whose angle is the rotor's, behind r_a + j x'_d.

        P_gap = Re(E' I*)
        2 H domega/dt = (P_m - P_gap) / omega - D (omega - 1)      ddelta/dt = w_s (omega - 1)

    Current out of the machine is positive. The size of E' is the signal `Efd`, set once from the
    operating point; so the machine carries a governor but no exciter. Not modelled: field and
    dampers, saliency, the effect of speed on the voltage, saturation, stator transients.
    """

    key = "classical"
    source = "Kundur 1994, section 5.3.1; Sauer and Pai 1998, section 5.6"
    parameters = PARAMETERS
    states = STATES
    controls = frozenset({"governor"})
    example = MappingProxyType({"H": 3.5, "D": 0.0, "ra": 0.0, "xd_p": 0.3})
    example_source = "Kundur 1994, example 12.2 (four 555 MVA units on an infinite bus)"
    norton = Equation(norton, ("Efd",), ("Epp_re", "Epp_im", "omega", "delta"))
    equations = (
        Equation(
            electrical, ("v_re", "v_im", "Epp_re", "Epp_im", "Efd"), ("Pe", "Ifd", "i_re", "i_im")
        ),
        Equation(motion, ("Epp_re", "Epp_im", "i_re", "i_im", "Pm", "w_s"), ()),
    )

    @classmethod
    def impedance(cls, p: Array) -> NDArray[np.complex128]:
        """Return (n,) r_a + j x'_d."""
        return p[P.ra] + 1j * p[P.xd_p]

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest, from terminal voltage and current (`i_re`, `i_im`)."""
        v = signals["v_re"] + 1j * signals["v_im"]
        i = signals["i_re"] + 1j * signals["i_im"]
        inner = v + cls.impedance(p) * i
        signals["Efd"][:] = signals["Ifd"][:] = np.abs(inner)
        signals["Pm"][:] = (inner * i.conj()).real
        return np.array([np.angle(inner), np.ones_like(signals["Pm"])])
