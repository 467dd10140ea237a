"""An exciter that copies PSTess 1.1, for comparison only: never shipped."""

import numpy as np

from tieline.grid.models.base import Array, Equation
from tieline.grid.models.blocks import clamp, lag_non_windup, lead_lag
from tieline.grid.models.exciters.st3_potential import P, ST3Potential, X


def equations(x: Array, u: Array, p: Array, dx: Array, y: Array) -> None:
    """Feed the bridge with |V| computed from the subtransient flux without the speed factor.

    E'' = omega psi'', and the terminal voltage is E'' - z I; PSTess uses |psi'' - z I| instead,
    which is |V + E'' (1/omega - 1)|. The regulator sees the true terminal voltage.
    """
    vt, v_s, Vref = u[0], u[1], u[2]
    rest = 1.0 / u[7] - 1.0
    v_re, v_im = u[3] + u[5] * rest, u[4] + u[6] * rest
    V_I = clamp(Vref - vt + v_s, p[P.VImin], p[P.VImax])
    V_A, dx[X.V_A] = lead_lag(V_I, x[X.V_A], p[P.TC], p[P.TB])
    V_R, dx[X.V_R] = lag_non_windup(V_A, x[X.V_R], p[P.KA], p[P.TA], p[P.VRmin], p[P.VRmax])
    y[0] = np.minimum(V_R * p[P.KP] * np.sqrt(v_re * v_re + v_im * v_im), p[P.Efdmax])


class PSTessST3(ST3Potential):
    """The shipped exciter with that one change."""

    equations = (
        Equation(
            equations,
            ("vt", "v_s", "Vref", "v_re", "v_im", "Epp_re", "Epp_im", "omega"),
            ("Efd",),
        ),
    )
