"""The linearisation of a model by central differences of its equations at rest."""

from collections.abc import Mapping

import numpy as np

from conformance.examples import evaluate, signals
from tieline.grid.models.base import Model

STEP = 1e-6


def column(model: type[Model], values: Mapping[str, float]) -> np.ndarray:
    """Return (parameters, 1) one unit's parameters."""
    return np.array([[values[parameter.symbol]] for parameter in model.parameters])


def transfer(
    model: type[Model], values: Mapping[str, float], given: str, got: str, s: complex
) -> complex:
    """Return d(got)/d(given) at `s` for one unit with parameters `values` by symbol."""
    p, named = column(model, values), signals(1)
    x0 = model.initialise(named, p)

    def at(x: np.ndarray, u: float) -> np.ndarray:
        moved = {**named, given: named[given] + u}
        dx, after = evaluate(model, x, moved, p)
        return np.concatenate([dx[:, 0], after[got]])

    n = len(x0)
    columns = []
    for i in range(n):
        d = np.zeros_like(x0)
        d[i] = STEP
        columns.append((at(x0 + d, 0.0) - at(x0 - d, 0.0)) / (2 * STEP))
    jacobian = np.array(columns).T
    b = (at(x0, STEP) - at(x0, -STEP)) / (2 * STEP)
    states = np.linalg.solve(s * np.eye(n) - jacobian[:n], b[:n])
    return jacobian[n] @ states + b[n]
