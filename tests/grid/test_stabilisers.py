"""The generalised stabiliser: what its two weights do."""

import numpy as np
import pytest

from conformance.examples import evaluate, parameters, signals
from tieline.grid.models.pss.delta_omega import DeltaOmega
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega, P


def outputs(model: type, p: np.ndarray, omega: float, wbar: float) -> tuple[np.ndarray, np.ndarray]:
    named = signals(1)
    named |= {"omega": np.array([omega]), "wbar": np.array([wbar])}
    x = np.array([[1e-3], [-2e-3], [3e-3]])
    dx, after = evaluate(model, x, named, p)
    return dx, after["v_s"]


@pytest.mark.parametrize("wbar", [1.0, 0.99, 1.3])
def test_with_equal_weights_the_average_drops_out_to_the_last_bit(wbar: float) -> None:
    """beta1 = beta2 = 1 is the standard stabiliser, immune to any delay."""
    p = parameters(GeneralizedDeltaOmega, 1)
    p[P.beta1] = p[P.beta2] = 1.0
    generalized = outputs(GeneralizedDeltaOmega, p, 0.9987, wbar)
    standard = outputs(DeltaOmega, p[: len(DeltaOmega.parameters)].copy(), 0.9987, wbar)
    np.testing.assert_array_equal(generalized[0], standard[0])
    np.testing.assert_array_equal(generalized[1], standard[1])


def test_the_control_error_is_the_papers_sum() -> None:
    """nu = beta1 (omega - wbar) + beta2 (wbar - w0), read off the washout's derivative."""
    p = parameters(GeneralizedDeltaOmega, 1)
    p[P.beta1], p[P.beta2] = 0.8, 0.3
    dx, _ = outputs(GeneralizedDeltaOmega, p, 0.998, 0.9995)
    nu = dx[0, 0] * p[P.Tw, 0] + 1e-3
    assert nu == pytest.approx(0.8 * (0.998 - 0.9995) + 0.3 * (0.9995 - 1.0), abs=1e-15)


def test_the_output_limit_clips_while_the_states_go_on() -> None:
    """The limit belongs to the output; a state that stopped would shift the phase for seconds."""
    p = parameters(DeltaOmega, 1)
    dx, v_s = outputs(DeltaOmega, p, 1.5, 1.0)
    assert v_s[0] == p[6, 0]
    assert dx[2, 0] != 0.0
