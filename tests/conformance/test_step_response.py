"""Exciters and governors in time against the inverse Laplace transform of what they declare."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from conformance.examples import ALL_MODELS, evaluate, signals
from conformance.linear import column
from tieline.grid.models.base import Model

TIMES_S = (0.05, 0.3, 1.0, 4.0)
STEP = 1e-6


def inverse_laplace(F: Callable[[complex], complex], t: float, terms: int = 20) -> float:
    """Return f(t), Re s of every pole being small: Abate and Valko 2004, fixed Talbot method."""
    r = 2 * terms / (5 * t)
    total = 0.5 * np.exp(r * t) * F(complex(r)).real
    for k in range(1, terms):
        angle = k * np.pi / terms
        cot = 1 / np.tan(angle)
        s = r * angle * (cot + 1j)
        total += (np.exp(t * s) * F(s) * (1 + 1j * (angle + (angle * cot - 1) * cot))).real
    return float(r / terms * total)


def test_the_inversion_gives_a_known_response() -> None:
    """The yardstick itself: 1 - exp(-t/2) is the step response of 1 / (1 + 2 s)."""
    for t in TIMES_S:
        # Twenty terms of the method leave 1e-11.
        assert inverse_laplace(lambda s: 1 / (s * (1 + 2 * s)), t) == pytest.approx(
            1 - np.exp(-t / 2), abs=1e-9
        )


@pytest.mark.parametrize(
    "model",
    [model for model in ALL_MODELS if model.role in ("exciter", "governor")],
    ids=lambda model: model.key,
)
def test_a_small_step_moves_the_output_as_declared(model: type[Model]) -> None:
    """A block may have the right gain at three frequencies and still start from a wrong state."""
    p, named = column(model, model.example), signals(1)
    x0 = model.initialise(named, p)
    at = {name: float(value[0]) for name, value in named.items()}
    for given, got in model.transfer(1j, model.example, at):
        moved = {**named, given: named[given] + STEP}

        def rate(t: float, x: np.ndarray, moved: dict[str, np.ndarray] = moved) -> np.ndarray:
            return evaluate(model, x[:, None], moved, p)[0][:, 0]

        run = solve_ivp(rate, (0, TIMES_S[-1]), x0[:, 0], "LSODA", TIMES_S, rtol=1e-12, atol=1e-13)
        after = [evaluate(model, x[:, None].copy(), moved, p)[1][got][0] for x in run.y.T]
        found = (np.array(after) - named[got][0]) / STEP

        def image(s: complex, pair: tuple[str, str] = (given, got)) -> complex:
            return model.transfer(s, model.example, at)[pair] / s

        declared = [inverse_laplace(image, t) for t in TIMES_S]
        # Saturation bends a step of 1e-6 times a gain of 200 by 1e-4.
        scale = np.abs(declared).max()
        np.testing.assert_allclose(found, declared, rtol=0, atol=1e-3 * scale)
