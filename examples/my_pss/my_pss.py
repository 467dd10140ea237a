"""A stabiliser of one's own: it damps what a unit does against the average, and nothing else."""

import numpy as np

from tieline.grid.models.base import Equation, Model, Parameter, indices
from tieline.grid.models.blocks import clamp, lead_lag, lead_lag_at, washout, washout_at

PARAMETERS = (
    Parameter("K", "pu", "gain", at_least=0),
    Parameter("Tw", "s", "washout", above=0),
    Parameter("T1", "s", "lead", at_least=0),
    Parameter("T2", "s", "lag", above=0),
    Parameter("limit", "pu", "largest output of either sign", above=0),
)
STATES = ("washout", "lead_lag")
P, X = indices(PARAMETERS), indices(STATES)


def equations(x, u, p, dx, y):
    """Write v_s; the rows of u and y are the signals named below, one column a unit."""
    omega, wbar = u[0], u[1]
    high, dx[X.washout] = washout(omega - wbar, x[X.washout], p[P.Tw])
    v, dx[X.lead_lag] = lead_lag(p[P.K] * high, x[X.lead_lag], p[P.T1], p[P.T2])
    y[0] = clamp(v, -p[P.limit], p[P.limit])


class SwingPSS(Model):
    """omega - wbar ->[K sTw/(1+sTw)]->[(1+sT1)/(1+sT2)]->[-limit, limit]-> v_s."""

    key = "swing_pss"
    role = "pss"
    source = "an example"
    parameters = PARAMETERS
    states = STATES
    equations = (Equation(equations, ("omega", "wbar"), ("v_s",)),)

    @classmethod
    def transfer(cls, s, p, at):
        """Return v_s over each input: what the equations are tested against."""
        forward = p["K"] * washout_at(s, p["Tw"]) * lead_lag_at(s, p["T1"], p["T2"])
        return {("omega", "v_s"): forward, ("wbar", "v_s"): -forward}

    @classmethod
    def initialise(cls, signals, p):
        """Return the states at rest, (states, n)."""
        return np.zeros((len(STATES), p.shape[1]))
