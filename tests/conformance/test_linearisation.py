"""Each control model's linearisation against the transfer function of its diagram."""

import numpy as np
import pytest

from conformance.examples import ALL_MODELS, evaluate, parameters, signals
from tieline.grid.models.base import Model

STEP = 1e-6


def transfer(model: type[Model], given: str, got: str, s: complex) -> complex:
    """Return d(got)/d(given) at `s`, by central differences of the equations at rest."""
    p, named = parameters(model, 1), signals(1)
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


@pytest.mark.parametrize("frequency_hz", [0.02, 0.4, 1.5])
@pytest.mark.parametrize("model", ALL_MODELS, ids=lambda model: model.key)
def test_the_linearisation_is_the_declared_transfer_function(
    model: type[Model], frequency_hz: float
) -> None:
    """A wrong sign or a swapped time constant would turn damping into excitation."""
    s = 2j * np.pi * frequency_hz
    at = {name: float(value[0]) for name, value in signals(1).items()}
    for (given, got), declared in model.transfer(s, model.example, at).items():
        # The equations are linear inside their limits; differences of 1e-6 leave 1e-9 of rounding,
        # times gains up to K_A / T_A = 1e4.
        assert transfer(model, given, got, s) == pytest.approx(declared, rel=1e-5), (given, got)


@pytest.mark.parametrize("model", ALL_MODELS, ids=lambda model: model.key)
def test_every_control_declares_a_transfer_function(model: type[Model]) -> None:
    """A control that declared none would never be held against its diagram."""
    at = {name: float(value[0]) for name, value in signals(1).items()}
    assert bool(model.transfer(1j, model.example, at)) is (model.role != "machine")
