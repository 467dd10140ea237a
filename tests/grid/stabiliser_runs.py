"""Runs one unit of a stabiliser on given signals, and asks it for its transfer functions."""

from collections.abc import Callable, Mapping

import numpy as np

from conformance.examples import evaluate, signals
from tieline.grid.models.base import Model

STEP_S = 1.0 / 240.0

Signals = Callable[[float], Mapping[str, float]]


def vector(model: type[Model], values: Mapping[str, float]) -> np.ndarray:
    """Return (parameters, 1) of values by symbol, which the model must accept."""
    assert all(parameter.allows(values[parameter.symbol]) for parameter in model.parameters)
    assert model.check(values) == []
    return np.array([[float(values[parameter.symbol])] for parameter in model.parameters])


def respond(
    model: type[Model], values: Mapping[str, float], at: Signals, seconds: float
) -> np.ndarray:
    """Return v_s at every step of the classical Runge-Kutta method, from rest at `at(0)`."""
    p = vector(model, values)

    def named(t: float) -> dict[str, np.ndarray]:
        return signals(1) | {name: np.array([value]) for name, value in at(t).items()}

    x = model.initialise(named(0.0), p)
    output = []
    for step in range(round(seconds / STEP_S)):
        t = step * STEP_S
        k1, now = evaluate(model, x, named(t), p)
        k2, _ = evaluate(model, x + STEP_S / 2 * k1, named(t + STEP_S / 2), p)
        k3, _ = evaluate(model, x + STEP_S / 2 * k2, named(t + STEP_S / 2), p)
        k4, _ = evaluate(model, x + STEP_S * k3, named(t + STEP_S), p)
        x = x + STEP_S / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        output.append(now["v_s"][0])
    return np.array(output)


def swing(t: float) -> dict[str, float]:
    """Return a speed, an average and a power that move apart: a dip with a swing upon it."""
    dip = -2e-3 * (1.0 - np.exp(-t / 3.0))
    return {
        "omega": 1.0 + dip + 8e-4 * np.sin(2.2 * t),
        "wbar": 1.0 + dip * (1.0 - np.exp(-t)),
        "Pe": 0.8 - 0.02 * np.sin(2.0 * t),
    }


def gain(
    model: type[Model], values: Mapping[str, float], given: str, f_hz: float | complex
) -> complex:
    """Return v_s over a signal at a frequency, as the model declares it."""
    return model.transfer(2j * np.pi * f_hz, values, {})[(given, "v_s")]
