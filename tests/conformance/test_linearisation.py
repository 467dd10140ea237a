"""Each control model's linearisation against the transfer function of its diagram."""

from collections.abc import Callable

import numpy as np
import pytest

from conformance.examples import EXAMPLES, evaluate, parameters, signals
from tieline.grid.models.base import Model
from tieline.grid.models.registry import models

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


def lead_lag(s: complex, T1: float, T2: float) -> complex:
    return (1 + s * T1) / (1 + s * T2)


def stabiliser(s: complex) -> complex:
    e = EXAMPLES["delta_omega"]
    washout = s * e["Tw"] / (1 + s * e["Tw"])
    return e["K"] * washout * lead_lag(s, e["T1"], e["T2"]) * lead_lag(s, e["T3"], e["T4"])


def governor(s: complex) -> complex:
    e = EXAMPLES["reheat_hydro"]
    shape = lead_lag(s, e["T3"], e["Tc"]) * lead_lag(s, e["T4"], e["T5"])
    return -e["K"] / (1 + s * e["Ts"]) * shape


def exciter(s: complex) -> complex:
    e = EXAMPLES["st3_potential"]
    return lead_lag(s, e["TC"], e["TB"]) * e["KA"] / (1 + s * e["TA"]) * e["KP"] * 1.02


BETA1, BETA2 = 1.0, 0.5

CASES = [
    ("pss", "delta_omega", "omega", "v_s", stabiliser),
    ("pss", "generalized_delta_omega", "omega", "v_s", lambda s: BETA1 * stabiliser(s)),
    ("pss", "generalized_delta_omega", "wbar", "v_s", lambda s: (BETA2 - BETA1) * stabiliser(s)),
    ("governor", "reheat_hydro", "omega", "Pm", governor),
    ("exciter", "st3_potential", "v_s", "Efd", exciter),
    ("exciter", "st3_potential", "Vref", "Efd", exciter),
]


@pytest.mark.parametrize("frequency_hz", [0.02, 0.4, 1.5])
@pytest.mark.parametrize(("role", "key", "given", "got", "expected"), CASES)
def test_the_linearisation_is_the_declared_transfer_function(
    role: str,
    key: str,
    given: str,
    got: str,
    expected: Callable[[complex], complex],
    frequency_hz: float,
) -> None:
    """A wrong sign or a swapped time constant would turn damping into excitation."""
    s = 2j * np.pi * frequency_hz
    # The equations are linear inside their limits; differences of 1e-6 leave 1e-9 of rounding,
    # times gains up to K_A / T_A = 1e4.
    got_value = transfer(models(role)[key], given, got, s)
    assert got_value == pytest.approx(expected(s), rel=1e-5)
