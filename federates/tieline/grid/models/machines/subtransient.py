"""The subtransient synchronous machine, round rotor and salient pole alike, without saturation."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_in_place
from tieline.grid.models.base import Array, Equation, Machine, Parameter, indices

PARAMETERS: tuple[Parameter, ...] = (
    Parameter("H", "s", "inertia constant", above=0),
    Parameter("D", "pu", "damping torque per speed deviation", at_least=0),
    Parameter("ra", "pu", "armature resistance", at_least=0),
    Parameter("xl", "pu", "leakage reactance", at_least=0),
    Parameter("xd", "pu", "direct-axis synchronous reactance", above=0),
    Parameter("xd_p", "pu", "direct-axis transient reactance", above=0),
    Parameter("xd_pp", "pu", "direct-axis subtransient reactance", above=0),
    Parameter("Td0_p", "s", "direct-axis transient open-circuit time constant", above=0),
    Parameter("Td0_pp", "s", "direct-axis subtransient open-circuit time constant", above=0),
    Parameter("xq", "pu", "quadrature-axis synchronous reactance", above=0),
    Parameter("xq_p", "pu", "quadrature-axis transient reactance", above=0),
    Parameter("xq_pp", "pu", "quadrature-axis subtransient reactance; equals xd_pp", above=0),
    Parameter("Tq0_p", "s", "quadrature-axis transient open-circuit time constant", above=0),
    Parameter("Tq0_pp", "s", "quadrature-axis subtransient open-circuit time constant", above=0),
)
STATES = ("delta", "omega", "Eq_p", "psi_kd", "Ed_p", "psi_kq")

P = indices(PARAMETERS)
X = indices(STATES)


@compiled_in_place
def fluxes(x: Array, p: Array) -> tuple[float, float]:
    """Return psi''_d and psi''_q of one unit with states `x` (states,), parameters `p`."""
    share_d = (p[P.xd_pp] - p[P.xl]) / (p[P.xd_p] - p[P.xl])
    share_q = (p[P.xq_pp] - p[P.xl]) / (p[P.xq_p] - p[P.xl])
    psi_d = share_d * x[X.Eq_p] + (1.0 - share_d) * x[X.psi_kd]
    psi_q = share_q * x[X.Ed_p] + (1.0 - share_q) * x[X.psi_kq]
    return psi_d, psi_q


@compiled_in_place
def currents(
    x: Array, v_d: float, v_q: float, p: Array, psi_d: float, psi_q: float
) -> tuple[float, float]:
    """Return i_d and i_q of one unit, given the terminal voltage on its axes."""
    d_d = -x[X.omega] * psi_q - v_d
    d_q = x[X.omega] * psi_d - v_q
    ra, xpp = p[P.ra], p[P.xd_pp]
    square = ra * ra + xpp * xpp
    return (ra * d_d + xpp * d_q) / square, (ra * d_q - xpp * d_d) / square


@compiled_in_place
def field_current(x: Array, p: Array, i_d: float) -> float:
    """Return I_fd = E'_q + (x_d - x'_d) [i_d + (x'_d - x'') / (x'_d - x_l)^2 e_a] of one unit."""
    span = p[P.xd_p] - p[P.xl]
    e_a = x[X.Eq_p] - x[X.psi_kd] - span * i_d
    return float(
        x[X.Eq_p] + (p[P.xd] - p[P.xd_p]) * (i_d + (p[P.xd_p] - p[P.xd_pp]) / (span * span) * e_a)
    )


def norton(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the voltage E'' behind the subtransient impedance, speed and angle.

    E'' = omega [(psi''_d cos delta - psi''_q sin delta)
                 + j (psi''_q cos delta + psi''_d sin delta)]
    """
    for i in range(x.shape[1]):
        psi_d, psi_q = fluxes(x[:, i], p[:, i])
        delta, omega = x[X.delta, i], x[X.omega, i]
        sin, cos = np.sin(delta), np.cos(delta)
        y[0, i] = omega * (psi_d * cos - psi_q * sin)
        y[1, i] = omega * (psi_q * cos + psi_d * sin)
        y[2, i] = omega
        y[3, i] = delta


def electrical(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write terminal power, field current and terminal current."""
    for i in range(x.shape[1]):
        terminals(x[:, i], u[:, i], p[:, i], y[:, i])


@compiled_in_place
def terminals(x: Array, u: Array, p: Array, y: Array) -> None:
    """Write one unit's terminal power, field current and terminal current."""
    psi_d, psi_q = fluxes(x, p)
    sin, cos = np.sin(x[X.delta]), np.cos(x[X.delta])
    v_d, v_q = sin * u[0] - cos * u[1], cos * u[0] + sin * u[1]
    i_d, i_q = currents(x, v_d, v_q, p, psi_d, psi_q)
    y[0] = v_d * i_d + v_q * i_q
    y[1] = field_current(x, p, i_d)
    y[2], y[3] = sin * i_d + cos * i_q, sin * i_q - cos * i_d


def motion(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the derivatives of rotor and fluxes (equations in the class docstring)."""
    for i in range(x.shape[1]):
        move(x[:, i], u[:, i], p[:, i], dx[:, i])


@compiled_in_place
def move(x: Array, u: Array, p: Array, dx: Array) -> None:
    """Write the derivatives of one unit's rotor and fluxes."""
    psi_d, psi_q = fluxes(x, p)
    sin, cos = np.sin(x[X.delta]), np.cos(x[X.delta])
    v_d, v_q = sin * u[0] - cos * u[1], cos * u[0] + sin * u[1]
    i_d, i_q = currents(x, v_d, v_q, p, psi_d, psi_q)
    Efd, Pm, w_s = u[2], u[3], u[4]
    span_q = p[P.xq_p] - p[P.xl]
    e_b = x[X.Ed_p] - x[X.psi_kq] - span_q * i_q
    torque = psi_d * i_q - psi_q * i_d
    dx[X.delta] = w_s * (x[X.omega] - 1.0)
    dx[X.omega] = (Pm / x[X.omega] - torque - p[P.D] * (x[X.omega] - 1.0)) / (2.0 * p[P.H])
    dx[X.Eq_p] = (Efd - field_current(x, p, i_d)) / p[P.Td0_p]
    dx[X.psi_kd] = (x[X.Eq_p] - x[X.psi_kd] - (p[P.xd_p] - p[P.xl]) * i_d) / p[P.Td0_pp]
    drop_q = i_q + (p[P.xq_p] - p[P.xq_pp]) / (span_q * span_q) * e_b
    dx[X.Ed_p] = (-x[X.Ed_p] - (p[P.xq] - p[P.xq_p]) * drop_q) / p[P.Tq0_p]
    dx[X.psi_kq] = e_b / p[P.Tq0_pp]


def at_rest(delta: Array, signals: dict[str, Array], p: Array) -> Array:
    """Return the states (states, n) at rest, without saturation, and set E_fd, I_fd and P_m."""
    v = signals["v_re"] + 1j * signals["v_im"]
    i = signals["i_re"] + 1j * signals["i_im"]
    to_dq = 1j * np.exp(-1j * delta)
    i_d, i_q = (to_dq * i).real, (to_dq * i).imag
    v_q = (to_dq * v).imag
    x = np.zeros((len(STATES), len(delta)))
    x[X.delta] = delta
    x[X.omega] = 1.0
    x[X.Eq_p] = v_q + p[P.ra] * i_q + p[P.xd_p] * i_d
    x[X.psi_kd] = x[X.Eq_p] - (p[P.xd_p] - p[P.xl]) * i_d
    x[X.Ed_p] = -(p[P.xq] - p[P.xq_p]) * i_q
    x[X.psi_kq] = x[X.Ed_p] - (p[P.xq_p] - p[P.xl]) * i_q
    signals["Efd"][:] = x[X.Eq_p] + (p[P.xd] - p[P.xd_p]) * i_d
    signals["Ifd"][:] = signals["Efd"]
    signals["Pm"][:] = (v * i.conj()).real + p[P.ra] * np.abs(i) ** 2
    return x


class Subtransient(Machine):
    """A machine with field and damper on the d axis and two dampers on the q axis.

        T'_d0  dE'_q/dt   = E_fd - I_fd                    e_a = E'_q - psi_kd - (x'_d - x_l) i_d
        T''_d0 dpsi_kd/dt = e_a                            e_b = E'_d - psi_kq - (x'_q - x_l) i_q
        T'_q0  dE'_d/dt   = -E'_d - (x_q - x'_q) [i_q + (x'_q - x'') / (x'_q - x_l)^2 e_b]
        T''_q0 dpsi_kq/dt = e_b
        T_e = psi''_d i_q - psi''_q i_d
        2 H domega/dt = P_m / omega - T_e - D (omega - 1)          ddelta/dt = w_s (omega - 1)

    Current out of the machine is positive. E'_d carries the sign that makes both axes look alike.
    Speed multiplies the subtransient flux, so that the terminal voltage feels the frequency.
    Not modelled: saturation, unequal subtransient reactances, stator transients.
    """

    key = "subtransient"
    source = "Kundur, Power System Stability and Control, 1994, sections 3.4 to 3.6 and 13.3"
    parameters = PARAMETERS
    states = STATES
    example = MappingProxyType(
        {
            "H": 6.5, "D": 0.0, "ra": 0.003, "xl": 0.17, "xd": 2.0, "xd_p": 0.2, "xd_pp": 0.18,
            "Td0_p": 7.5, "Td0_pp": 0.025, "xq": 1.9, "xq_p": 0.7, "xq_pp": 0.18, "Tq0_p": 0.5,
            "Tq0_pp": 0.06,
        }
    )  # fmt: skip
    example_source = "steam unit of the miniWECC (Trudnowski 2011), with a resistance added"
    norton = Equation(norton, (), ("Epp_re", "Epp_im", "omega", "delta"))
    equations = (
        Equation(electrical, ("v_re", "v_im"), ("Pe", "Ifd", "i_re", "i_im")),
        Equation(motion, ("v_re", "v_im", "Efd", "Pm", "w_s"), ()),
    )

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what contradicts x_l < x'' <= x' <= x on either axis, or x''_q = x''_d."""
        wrong = []
        for axis in "dq":
            names = ("xl", f"x{axis}_pp", f"x{axis}_p", f"x{axis}")
            leak, sub, transient, synchronous = (values[name] for name in names)
            if not leak < sub <= transient <= synchronous:
                given = ", ".join(f"{name} = {values[name]:g}" for name in names)
                wrong.append(
                    f"needs {' < '.join(names[:2])} <= {' <= '.join(names[2:])} (got {given})"
                )
        if values["xq_pp"] != values["xd_pp"]:
            wrong.append(f"needs xq_pp = xd_pp (got {values['xq_pp']:g} and {values['xd_pp']:g})")
        return wrong

    @classmethod
    def impedance(cls, p: Array) -> NDArray[np.complex128]:
        """Return (n,) r_a + j x''."""
        return p[P.ra] + 1j * p[P.xd_pp]

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest, from terminal voltage and current (`i_re`, `i_im`)."""
        v = signals["v_re"] + 1j * signals["v_im"]
        i = signals["i_re"] + 1j * signals["i_im"]
        return at_rest(np.angle(v + (p[P.ra] + 1j * p[P.xq]) * i), signals, p)
