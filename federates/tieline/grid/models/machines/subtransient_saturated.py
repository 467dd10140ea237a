"""The subtransient synchronous machine with saturation of both axes."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from tieline.compiled import compiled
from tieline.grid.models import checks
from tieline.grid.models.base import Array, Equation, Parameter, indices
from tieline.grid.models.characteristics import saturation
from tieline.grid.models.machines import subtransient
from tieline.grid.models.machines.subtransient import (
    Subtransient,
    X,
    fluxes,
    move,
    terminals,
)

PARAMETERS = (
    *subtransient.PARAMETERS,
    Parameter("S10", "pu", "saturation S(1.0) at rated flux", at_least=0),
    Parameter("S12", "pu", "saturation S(1.2) at 1.2 times rated flux", at_least=0),
)

P = indices(PARAMETERS)


@compiled
def saturated(psi_d: Array, psi_q: Array, p: Array) -> tuple[Array, Array]:
    """Return the two axes' saturation, S psi''_d and S psi''_q (x_q - x_l) / (x_d - x_l)."""
    level = np.sqrt(psi_d * psi_d + psi_q * psi_q)
    s = saturation(level, 1.0, p[P.S10], 1.2, p[P.S12])
    return s * psi_d, s * psi_q * (p[P.xq] - p[P.xl]) / (p[P.xd] - p[P.xl])


@compiled
def saturation_at(x: Array, p: Array) -> tuple[Array, Array]:
    """Return the two axes' saturation (n,) at the states `x`."""
    psi_d, psi_q = np.empty(x.shape[1]), np.empty(x.shape[1])
    for i in range(x.shape[1]):
        psi_d[i], psi_q[i] = fluxes(x[:, i], p[:, i])
    return saturated(psi_d, psi_q, p)


def electrical(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write terminal power, saturated field current and terminal current."""
    for i in range(x.shape[1]):
        terminals(x[:, i], u[:, i], p[:, i], y[:, i])
    y[1] += saturation_at(x, p)[0]


def motion(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Write the derivatives of rotor and fluxes: those without saturation, less its two terms."""
    for i in range(x.shape[1]):
        move(x[:, i], u[:, i], p[:, i], dx[:, i])
    more_d, more_q = saturation_at(x, p)
    dx[X.Eq_p] -= more_d / p[P.Td0_p]
    dx[X.Ed_p] -= more_q / p[P.Tq0_p]


class SubtransientSaturated(Subtransient):
    """The machine `subtransient` whose iron saturates with the size of its subtransient flux.

        S = S(|psi''|), the scaled quadratic through S(1.0) and S(1.2)
        T'_d0 dE'_q/dt = E_fd - I_fd,           I_fd = I_fd(unsaturated) + S psi''_d
        T'_q0 dE'_d/dt = (unsaturated) - S psi''_q (x_q - x_l) / (x_d - x_l)

    All else is as in `subtransient`, and with S(1.0) = S(1.2) = 0 everything is. Not modelled:
    saturation of the subtransient and leakage reactances, cross-magnetising, unequal subtransient
    reactances, stator transients.
    """

    key = "subtransient_saturated"
    source = (
        "Kundur 1994, sections 3.8 and 4.2; the form of the round-rotor machine GENROU, with the "
        "two points of IEEE Std 1110 and IEEE Std 421.5-2016, Annex C"
    )
    parameters = PARAMETERS
    example = MappingProxyType({**Subtransient.example, "S10": 0.05, "S12": 0.3})
    example_source = "the example of `subtransient`, saturation from the two-area system's data"
    equations = (
        Equation(electrical, ("v_re", "v_im"), ("Pe", "Ifd", "i_re", "i_im")),
        Equation(motion, ("v_re", "v_im", "Efd", "Pm", "w_s"), ()),
    )

    @classmethod
    def check(cls, values: Mapping[str, float]) -> list[str]:
        """Return what is wrong with the reactances or the two points of saturation."""
        points = {"1.0": 1.0, "1.2": 1.2, **values}
        return super().check(values) + checks.saturation(points, "1.0", "S10", "1.2", "S12")

    @classmethod
    def initialise(cls, signals: dict[str, Array], p: Array) -> Array:
        """Return the states at rest; the flux E'' = V + (r_a + j x'') I gives the saturation.

        The q axis lies along (1 + S_q) E'' + j (x_q - x'') I with S_q = S (x_q-x_l)/(x_d-x_l).
        """
        i = signals["i_re"] + 1j * signals["i_im"]
        flux = signals["v_re"] + 1j * signals["v_im"] + cls.impedance(p) * i
        _, s_q = saturated(np.zeros_like(i.real), np.abs(flux), p)
        s_q /= np.abs(flux)
        delta = np.angle((1.0 + s_q) * flux + 1j * (p[P.xq] - p[P.xq_pp]) * i)
        x = subtransient.at_rest(delta, signals, p)
        flux = 1j * np.exp(-1j * delta) * flux
        more_d, more_q = saturated(flux.imag, -flux.real, p)
        x[X.Ed_p] -= more_q
        x[X.psi_kq] -= more_q
        signals["Efd"][:] += more_d
        signals["Ifd"][:] = signals["Efd"]
        return x
