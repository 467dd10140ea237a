"""One example parameter set for every device model, with its source, and signals to try it with."""

from collections.abc import Mapping

import numpy as np

from tieline.grid.models.base import SIGNALS, Machine, Model
from tieline.grid.models.registry import models

ROUND_ROTOR = {
    "H": 6.5, "D": 0.0, "ra": 0.003, "xl": 0.17, "xd": 2.0, "xd_p": 0.2, "xd_pp": 0.18,
    "Td0_p": 7.5, "Td0_pp": 0.025, "xq": 1.9, "xq_p": 0.7, "xq_pp": 0.18, "Tq0_p": 0.5,
    "Tq0_pp": 0.06,
}  # fmt: skip
STABILISER = {
    "K": 9.0, "Tw": 10.0, "T1": 0.25, "T2": 0.04, "T3": 0.2, "T4": 0.03,
    "vsmax": 0.1, "vsmin": -0.1,
}  # fmt: skip

EXAMPLES: Mapping[str, Mapping[str, float]] = {
    # miniWECC (Trudnowski 2011), its steam units; a resistance added so that it is exercised.
    "subtransient": ROUND_ROTOR,
    # miniWECC, every unit.
    "st3_potential": {
        "KA": 200.0, "TA": 0.02, "TB": 10.0, "TC": 1.0, "VImax": 0.1, "VImin": -0.1,
        "VRmax": 5.0, "VRmin": -5.0, "KP": 1.0, "Efdmax": 5.0,
    },
    # miniWECC, slow hydro.
    "reheat_hydro": {
        "K": 20.0, "Tmax": 1.0, "Ts": 0.5, "Tc": 15.0, "T3": 1.0, "T4": -1.0, "T5": 0.5,
    },
    # miniWECC with the gain of the G26 trip.
    "delta_omega": STABILISER,
    "generalized_delta_omega": {**STABILISER, "beta1": 1.0, "beta2": 0.5},
}  # fmt: skip

ALL_MODELS = [
    model for role in ("machine", "exciter", "governor", "pss") for model in models(role).values()
]


def parameters(model: type[Model], n: int) -> np.ndarray:
    """Return (parameters, n) the example set, varied by a percent from unit to unit.

    Numbers on which limits or equalities rest stay as they are.
    """
    example = EXAMPLES[model.key]
    fixed = {"xq_pp", "xd_pp", "beta1", "beta2"}
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
    named["Pm"] = 0.8 - 0.01 * spread
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
