"""The transient (two-axis) synchronous machine: field and one damper, no subtransients."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tieline.grid.models.base import Array, Equation, Machine, Parameter, indices
from tieline.grid.models.machines.subtransient import PARAMETERS as SUBTRANSIENT
from tieline.grid.models.park import current_behind, swing, to_rotor

_NAMES = ("H", "D", "ra", "xd", "xd_p", "Td0_p", "xq", "Tq0_p")
PARAMETERS = (
    *(parameter for parameter in SUBTRANSIENT if parameter.symbol in _NAMES),
    Parameter("xq_p", "pu", "quadrature-axis transient reactance; equals xd_p", above=0),
)
STATES = ("delta", "omega", "Eq_p", "Ed_p")

P = indices(PARAMETERS)
X = indices(STATES)


def norton(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the voltage E' behind the transient impedance, speed and angle."""
    sin, cos = np.sin(x[X.delta]), np.cos(x[X.delta])
    y[0] = x[X.omega] * (x[X.Eq_p] * cos - x[X.Ed_p] * sin)
    y[1] = x[X.omega] * (x[X.Ed_p] * cos + x[X.Eq_p] * sin)
    y[2] = x[X.omega]
    y[3] = x[X.delta]


def electrical(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write terminal power, field current and terminal current."""
    i_re, i_im = current_behind(u[2], u[3], u[0], u[1], p[P.ra], p[P.xd_p])
    i_d, _ = to_rotor(x[X.delta], i_re, i_im)
    y[0] = u[0] * i_re + u[1] * i_im
    y[1] = x[X.Eq_p] + (p[P.xd] - p[P.xd_p]) * i_d
    y[2] = i_re
    y[3] = i_im


def motion(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the derivatives of rotor and transient voltages (equations in the class docstring)."""
    Ifd, Efd, Pm, w_s = u[2], u[3], u[4], u[5]
    i_d, i_q = to_rotor(x[X.delta], u[0], u[1])
    torque = x[X.Eq_p] * i_q - x[X.Ed_p] * i_d
    dx[X.delta] = w_s * (x[X.omega] - 1.0)
    dx[X.omega] = swing(x[X.omega], Pm, torque, p[P.D], p[P.H])
    dx[X.Eq_p] = (Efd - Ifd) / p[P.Td0_p]
    dx[X.Ed_p] = (-x[X.Ed_p] - (p[P.xq] - p[P.xq_p]) * i_q) / p[P.Tq0_p]


class Transient(Machine):
    """A machine with a field winding on the d axis and one damper on the q axis.

        T'_d0 dE'_q/dt = E_fd - I_fd          I_fd = E'_q + (x_d - x'_d) i_d
        T'_q0 dE'_d/dt = -E'_d - (x_q - x'_q) i_q
        T_e = E'_q i_q - E'_d i_d
        2 H domega/dt = P_m / omega - T_e - D (omega - 1)          ddelta/dt = w_s (omega - 1)

    Current out of the machine is positive. E'_d carries the sign that makes both axes look alike.
    Speed multiplies the flux, as in `subtransient`, of which this is the machine with x'' = x'.
    Not modelled: subtransients, transient saliency (x'_q = x'_d), saturation, stator transients.
    """

    key = "transient"
    source = (
        "Sauer and Pai, Power System Dynamics and Stability, 1998, section 5.4 (two-axis model)"
    )
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "H": 6.5, "D": 0.0, "ra": 0.0025, "xd": 1.8, "xd_p": 0.3, "Td0_p": 8.0, "xq": 1.7,
            "Tq0_p": 0.4, "xq_p": 0.3,
        }
    )  # fmt: skip
    example_source = "Kundur 1994, example 12.6, with x'_q = x'_d and no subtransients"
    norton = Equation(norton, (), ("Epp_re", "Epp_im", "omega", "delta"))
    equations = (
        Equation(electrical, ("v_re", "v_im", "Epp_re", "Epp_im"), ("Pe", "Ifd", "i_re", "i_im")),
        Equation(motion, ("i_re", "i_im", "Ifd", "Efd", "Pm", "w_s"), ()),
    )

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what contradicts x' <= x on either axis, or x'_q = x'_d."""
        wrong = [
            f"needs x{axis}_p <= x{axis} (got {values[f'x{axis}_p']:g} and {values[f'x{axis}']:g})"
            for axis in "dq"
            if values[f"x{axis}_p"] > values[f"x{axis}"]
        ]
        if values["xq_p"] != values["xd_p"]:
            wrong.append(f"needs xq_p = xd_p (got {values['xq_p']:g} and {values['xd_p']:g})")
        return wrong

    @classmethod
    def impedance(cls, p: Array) -> NDArray[np.complex128]:
        """Return (n,) r_a + j x'."""
        return p[P.ra] + 1j * p[P.xd_p]

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest, from terminal voltage and current (`i_re`, `i_im`)."""
        v = signals["v_re"] + 1j * signals["v_im"]
        i = signals["i_re"] + 1j * signals["i_im"]
        delta = np.angle(v + (p[P.ra] + 1j * p[P.xq]) * i)
        e_d, e_q = to_rotor(delta, *_parts(v + cls.impedance(p) * i))
        i_d, _ = to_rotor(delta, i.real, i.imag)
        signals["Efd"][:] = signals["Ifd"][:] = e_q + (p[P.xd] - p[P.xd_p]) * i_d
        signals["Pm"][:] = (v * i.conj()).real + p[P.ra] * np.abs(i) ** 2
        return np.array([delta, np.ones_like(delta), e_q, -e_d])


def _parts(phasor: NDArray[np.complex128]) -> tuple[Array, Array]:
    return phasor.real, phasor.imag
