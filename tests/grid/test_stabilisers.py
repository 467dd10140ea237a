"""The generalised stabiliser: what its two weights do, in each of its three forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conformance.examples import evaluate, parameters, signals
from grid.stabiliser_runs import gain, respond, swing
from tieline.grid.models.base import Model
from tieline.grid.models.pss.delta_omega import DeltaOmega
from tieline.grid.models.pss.generalized_constant_reference import GeneralizedConstantReference
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega, P, X
from tieline.grid.models.pss.generalized_synchronous_reference import (
    GeneralizedSynchronousReference,
)

OTHER_FORMS = [GeneralizedConstantReference, GeneralizedSynchronousReference]
EXAMPLE = GeneralizedDeltaOmega.example
BETAS = [(1.0, 0.5), (0.5, 1.0), (0.33, 0.33), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)]


def outputs(model: type, p: np.ndarray, omega: float, wbar: float) -> tuple[np.ndarray, np.ndarray]:
    named = signals(1)
    named |= {"omega": np.array([omega]), "wbar": np.array([wbar])}
    x = np.array([[1e-3], [-2e-3], [3e-3], [0.0]])[: len(model.states)]
    dx, after = evaluate(model, x, named, p)
    return dx, after["v_s"]


def standard_parameters() -> np.ndarray:
    return np.array([[EXAMPLE[p.symbol]] for p in DeltaOmega.parameters])


@pytest.mark.parametrize("wbar", [1.0, 0.99, 1.3])
def test_with_equal_weights_the_average_drops_out_to_the_last_bit(wbar: float) -> None:
    """beta1 = beta2 = 1 is the standard stabiliser, immune to any delay."""
    p = parameters(GeneralizedDeltaOmega, 1)
    p[P.beta1] = p[P.beta2] = 1.0
    generalized = outputs(GeneralizedDeltaOmega, p, 0.9987, wbar)
    standard = outputs(DeltaOmega, standard_parameters(), 0.9987, wbar)
    np.testing.assert_array_equal(generalized[0][: X.third], standard[0])
    np.testing.assert_array_equal(generalized[1], standard[1])
    assert generalized[0][X.third, 0] == 0.0


def test_the_control_error_is_the_papers_sum() -> None:
    """nu = beta1 (omega - wbar) + beta2 (wbar - w0), read off the washout's derivative."""
    p = parameters(GeneralizedDeltaOmega, 1)
    p[P.beta1], p[P.beta2] = 0.8, 0.3
    dx, _ = outputs(GeneralizedDeltaOmega, p, 0.998, 0.9995)
    nu = dx[0, 0] * p[P.Tw, 0] + 1e-3
    assert nu == pytest.approx(0.8 * (0.998 - 0.9995) + 0.3 * (0.9995 - 1.0), abs=1e-15)


def test_the_output_limit_clips_while_the_states_go_on() -> None:
    """The limit belongs to the output; a state that stopped would shift the phase for seconds."""
    dx, v_s = outputs(DeltaOmega, standard_parameters(), 1.5, 1.0)
    assert v_s[0] == EXAMPLE["vsmax"]
    assert dx[2, 0] != 0.0


@pytest.mark.parametrize("betas", BETAS)
@pytest.mark.parametrize("model", OTHER_FORMS, ids=lambda model: model.key)
def test_the_three_forms_have_one_transfer_function(
    model: type[Model], betas: tuple[float, float]
) -> None:
    """Which form a vendor builds must not matter to what the paper shows."""
    values = {**EXAMPLE, "beta1": betas[0], "beta2": betas[1]}
    for name in ("omega", "wbar"):
        for f_hz in (0.044, 0.37, 1.0):
            assert gain(model, values, name, f_hz) == gain(
                GeneralizedDeltaOmega, values, name, f_hz
            )


@pytest.mark.parametrize("betas", BETAS)
@pytest.mark.parametrize("model", OTHER_FORMS, ids=lambda model: model.key)
def test_the_three_forms_give_one_response(model: type[Model], betas: tuple[float, float]) -> None:
    """The declared transfer function is shared; this holds the equations of each form to it."""
    values = {**EXAMPLE, "beta1": betas[0], "beta2": betas[1]}
    main = respond(GeneralizedDeltaOmega, values, swing, 4.0)
    other = respond(model, values, swing, 4.0)
    # Speeds near 1 are rounded at 1e-16; K times both leads over both lags makes 400 of it.
    np.testing.assert_allclose(other, main, rtol=0, atol=1e-13)
    assert np.abs(main).max() > 1e-3 or betas == (0.0, 0.0)


@settings(max_examples=60, deadline=None)
@given(
    beta1=st.floats(0, 1),
    beta2=st.one_of(st.just(0.0), st.floats(1e-3, 1)),
    omega=st.floats(0.9, 1.1),
    wbar=st.floats(0.9, 1.1),
)
def test_the_three_forms_agree_for_any_weights_and_speeds(
    beta1: float, beta2: float, omega: float, wbar: float
) -> None:
    """The form with synchronous reference divides by beta2, so small ones deserve a look."""
    p = parameters(GeneralizedDeltaOmega, 1)
    p[P.beta1], p[P.beta2] = beta1, beta2
    main, _ = outputs(GeneralizedDeltaOmega, p, omega, wbar)
    for model in OTHER_FORMS:
        other, _ = outputs(model, p, omega, wbar)
        # The last lag's derivative: rounding of 1e-16 times K T1/T2 T3/T4 / T4.
        np.testing.assert_allclose(other, main, rtol=0, atol=1e-10)


@pytest.mark.parametrize("stages", [1, 2, 3])
def test_stages_whose_constants_are_zero_are_bypassed(stages: int) -> None:
    """A tuning with one lead-lag must not carry two hidden ones."""
    pairs = (("T1", "T2"), ("T3", "T4"), ("T5", "T6"))
    values = {**EXAMPLE, "T5": 0.15, "T6": 0.05}
    values |= {symbol: 0.0 for pair in pairs[stages:] for symbol in pair}
    s = 2j * np.pi * 0.7
    expected = values["K"] * s * values["Tw"] / (1 + s * values["Tw"])
    for lead, lag in pairs[:stages]:
        expected *= (1 + s * values[lead]) / (1 + s * values[lag])
    declared = gain(GeneralizedDeltaOmega, values | {"beta1": 1.0}, "omega", 0.7)
    assert declared == pytest.approx(expected, rel=1e-12)
    # The equations: after 30 s of a 0.7 Hz sine the output is that gain's sine and no more.
    values |= {"vsmax": 10.0, "vsmin": -10.0, "beta1": 1.0, "beta2": 1.0}
    got = respond(
        GeneralizedDeltaOmega,
        values,
        lambda t: {"omega": 1.0 + 1e-3 * np.sin(2 * np.pi * 0.7 * t)},
        30.0,
    )[-1000:]
    # The washout's start has decayed to exp(-3) of a twentieth of the amplitude.
    assert np.ptp(got) / 2e-3 == pytest.approx(abs(expected), rel=2e-3)


def test_a_lead_without_its_lag_is_refused() -> None:
    """A bypass needs both constants to be 0; half of one is a slip of the pen."""
    values = {**EXAMPLE, "T5": 0.3}
    (finding,) = GeneralizedDeltaOmega.check(values)
    assert "needs T6 > 0 s beside T5 = 0.3 s" in finding
