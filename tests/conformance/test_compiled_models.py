"""Every model's equations as the integrator runs them: compiled."""

from typing import Any

import numpy as np
import pytest

from conformance.examples import ALL_MODELS, parameters, signals
from tieline.by_address import caller, first_class
from tieline.compiled import compiled
from tieline.grid.models.base import SIGNATURE, Machine, Model

call_of_model = caller(SIGNATURE)


@compiled
def call(
    functions: Any, x: np.ndarray, u: np.ndarray, p: np.ndarray, dx: np.ndarray, y: np.ndarray
) -> None:
    call_of_model(functions, 0, (x, u, p, dx, y))


@pytest.mark.parametrize("model", ALL_MODELS, ids=lambda model: model.key)
def test_a_compiled_equation_gives_what_it_gives_as_python(model: type[Model]) -> None:
    """An equation that the compiler refuses would fail at a user's first run, not here."""
    p, named = parameters(model, 3), signals(3)
    x = np.ascontiguousarray(model.initialise(named, p))
    x += 0.01 * np.random.default_rng(3).normal(size=x.shape)
    norton = (model.norton,) if issubclass(model, Machine) else ()
    for equation in (*norton, *model.equations):
        u = np.array([named[name] for name in equation.inputs]).reshape(-1, 3)
        plain = np.zeros_like(x), np.zeros((len(equation.outputs), 3))
        equation.function(x, u, p, *plain)
        machine_code = np.zeros_like(x), np.zeros((len(equation.outputs), 3))
        call(first_class([equation.function], SIGNATURE), x, u, p, *machine_code)
        for found, expected in zip(machine_code, plain, strict=True):
            # The last bits of sines and square roots, times gains up to K_A / T_A = 2e4.
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
