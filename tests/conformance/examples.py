"""Every device model on its example parameters, and signals to try it with."""

import numpy as np

from tieline.grid.models.base import SIGNALS, Machine, Model
from tieline.grid.models.registry import models

ALL_MODELS = [
    model for role in ("machine", "exciter", "governor", "pss") for model in models(role).values()
]


def parameters(model: type[Model], n: int) -> np.ndarray:
    """Return (parameters, n) the example set, varied by a percent from unit to unit.

    Numbers on which limits or equalities rest stay as they are.
    """
    example = model.example
    fixed = {"xq_pp", "xd_pp", "beta1", "beta2", "M", "N"}
    factors = 1.0 + 0.01 * np.arange(n)
    return np.array(
        [
            example[p.symbol] * (np.ones(n) if p.symbol in fixed else factors)
            for p in model.parameters
        ]
    )


def signals(n: int) -> dict[str, np.ndarray]:
    """Return every signal of n units at synchronous speed, loaded a little differently each."""
    spread = np.arange(n)
    named = {name: np.zeros(n) for name in SIGNALS}
    v = (1.02 + 0.002 * spread) * np.exp(1j * (0.1 + 0.05 * spread))
    i = np.conj((0.8 - 0.01 * spread + 0.2j) / v)
    named |= {"v_re": v.real, "v_im": v.imag, "vt": np.abs(v), "i_re": i.real, "i_im": i.imag}
    for name in ("omega", "wbar", "w0"):
        named[name] = np.ones(n)
    named["w_s"] = np.full(n, 120.0 * np.pi)
    named["Efd"] = 2.1 + 0.01 * spread
    named["Ifd"] = 2.1 + 0.01 * spread
    named["Pm"] = 0.8 - 0.01 * spread
    named["Pe"] = (v * np.conj(i)).real
    return named


def evaluate(
    model: type[Model], x: np.ndarray, named: dict[str, np.ndarray], p: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return derivatives and all signals after every equation of a model, in their order."""
    named = {name: value.copy() for name, value in named.items()}
    dx = np.zeros_like(x)
    norton = (model.norton,) if issubclass(model, Machine) else ()
    for equation in (*norton, *model.equations):
        u = np.array([named[name] for name in equation.inputs]).reshape(-1, x.shape[1])
        y = np.zeros((len(equation.outputs), x.shape[1]))
        equation.function(x, u, p, dx, y)
        named |= dict(zip(equation.outputs, y, strict=True))
    return dx, named
