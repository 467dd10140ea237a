"""The generalised stabiliser on the integral of accelerating power: no torsion, the same damping.

With mechanical power at rest the swing equation ties power to the speed of the whole shaft,
Pe = -2 H s omega. A torsional mode moves the measured end of the shaft and leaves Pe alone.
"""

import numpy as np
import pytest

from grid.stabiliser_runs import gain, respond, swing
from tieline.grid.models.base import Model
from tieline.grid.models.pss.generalized_delta_omega import GeneralizedDeltaOmega
from tieline.grid.models.pss.generalized_pss2c import GeneralizedPSS2C
from tieline.grid.models.pss.pss2c import PSS2C

H = 5.0
TUNING = {"T1": 0.25, "T2": 0.04, "T3": 0.2, "T4": 0.03}
PLAIN = {**GeneralizedDeltaOmega.example, **TUNING, "K": 9.0, "Tw": 10.0}
DUAL = {
    **GeneralizedPSS2C.example, **TUNING,
    "KS1": 9.0, "Tw1": 10.0, "Tw2": 0.0, "Tw3": 10.0, "Tw4": 0.0, "T7": 10.0, "KS2": 10.0 / (2 * H),
}  # fmt: skip
BETAS = [(1.0, 0.5), (0.5, 1.0), (1.0, 1.0), (1.0, 0.0)]


def shaft_gain(model: type[Model], values: dict[str, float], f_hz: float) -> complex:
    """Return v_s over the speed of a shaft that turns as one, its power with it."""
    result = gain(model, values, "omega", f_hz)
    if model is GeneralizedPSS2C:
        s = 2j * np.pi * f_hz
        result += gain(model, values, "Pe", f_hz) * (-2 * H * s)
    return result


def weighted(values: dict[str, float], betas: tuple[float, float]) -> dict[str, float]:
    return {**values, "beta1": betas[0], "beta2": betas[1]}


@pytest.mark.parametrize("betas", BETAS)
@pytest.mark.parametrize("f_hz", [15.0, 20.0, 25.0])
def test_a_torsional_mode_does_not_reach_the_field(f_hz: float, betas: tuple[float, float]) -> None:
    """A stabiliser that feeds the twist of a shaft has broken shafts."""
    plain = gain(GeneralizedDeltaOmega, weighted(PLAIN, betas), "omega", f_hz)
    dual = gain(GeneralizedPSS2C, weighted(DUAL, betas), "omega", f_hz)
    # |(1 + s T8) / (1 + s T9)^5| is 6e-4 at 15 Hz and falls with the fourth power from there.
    assert abs(dual) < 1e-3 * abs(plain)


@pytest.mark.parametrize("betas", BETAS)
@pytest.mark.parametrize("f_hz", [0.04, 0.1, 0.37, 0.62, 1.0, 2.0])
def test_below_two_hertz_both_give_the_same_damping(
    f_hz: float, betas: tuple[float, float]
) -> None:
    """The front end is to take the twist off, not to retune the stabiliser."""
    plain = shaft_gain(GeneralizedDeltaOmega, weighted(PLAIN, betas), f_hz)
    dual = shaft_gain(GeneralizedPSS2C, weighted(DUAL, betas), f_hz)
    # omega [1 + (R - 1) / (1 + s T7)]: |R - 1| grows with f^2 to about 2 while s T7 grows with f;
    # the largest quotient, 0.028, lies near 0.8 Hz.
    assert dual == pytest.approx(plain, rel=0.03)
    average = [
        gain(model, weighted(values, betas), "wbar", f_hz)
        for model, values in ((GeneralizedDeltaOmega, PLAIN), (GeneralizedPSS2C, DUAL))
    ]
    assert average[1] == pytest.approx(average[0], rel=1e-12)


def test_a_twisting_shaft_in_time() -> None:
    """The same statement with the equations themselves, at rest but for a 20 Hz twist."""
    rng = {"VSTmax": 10.0, "VSTmin": -10.0}
    plain = weighted(PLAIN, (1.0, 0.5)) | {"vsmax": 10.0, "vsmin": -10.0}
    dual = weighted(DUAL, (1.0, 0.5)) | rng

    def twist(t: float) -> dict[str, float]:
        return {"omega": 1.0 + 1e-3 * np.sin(2 * np.pi * 20.0 * t), "Pe": 0.8}

    shaken = np.abs(respond(GeneralizedDeltaOmega, plain, twist, 3.0)[480:]).max()
    calm = np.abs(respond(GeneralizedPSS2C, dual, twist, 3.0)[480:]).max()
    assert shaken > 0.2
    assert calm < 1e-3 * shaken


def test_a_ramp_of_mechanical_power_is_not_taken_for_a_swing() -> None:
    """A unit that is loaded by its governor must not have its voltage pushed about.

    Power follows the turbine while the speed stays; a filter of another order than T8 = M T9 would
    leave an error in proportion to the ramp.
    """

    def ramp(t: float) -> dict[str, float]:
        return {"Pe": 0.5 + 0.01 * t}

    def peak(values: dict[str, float]) -> float:
        return float(np.abs(respond(PSS2C, values, ramp, 20.0)[2400:]).max())

    tracking = {name: DUAL[name] for name in PSS2C.example}
    assert peak(tracking) < 0.2 * peak(tracking | {"T8": 0.2})


def test_with_both_weights_one_it_is_pss2c_to_the_last_bit() -> None:
    """What utilities run today is a special case, and immune to any delay of the average."""
    values = GeneralizedPSS2C.example | {"beta1": 1.0, "beta2": 1.0}
    standard = {name: values[name] for name in PSS2C.example}
    np.testing.assert_array_equal(
        respond(GeneralizedPSS2C, values, swing, 3.0), respond(PSS2C, standard, swing, 3.0)
    )


def test_a_filter_that_does_not_follow_ramps_is_refused() -> None:
    """The derivation rests on R'(0) = 0."""
    (finding,) = GeneralizedPSS2C.check({**GeneralizedPSS2C.example, "T8": 0.2})
    assert "needs T8 = M T9" in finding
    assert "got 0.2 s and 5 x 0.1 s" in finding
