"""The subtransient machine against formulas that its equations do not contain."""

import numpy as np
import pytest

from conformance.examples import evaluate, parameters, signals
from tieline.grid.models.machines.subtransient import Subtransient, X

e = Subtransient.example


def test_at_rest_the_terminal_power_follows_the_power_angle_formula() -> None:
    """P = E V sin(delta') / x_d + V^2 (1/x_q - 1/x_d) sin(2 delta') / 2, Kundur equation 3.133."""
    p, named = parameters(Subtransient, 1), signals(1)
    p[2] = 0.0
    x = Subtransient.initialise(named, p)
    v = named["v_re"][0] + 1j * named["v_im"][0]
    angle = x[X.delta, 0] - np.angle(v)
    excitation = named["Efd"][0] * abs(v) * np.sin(angle) / e["xd"]
    reluctance = abs(v) ** 2 / 2 * (1 / e["xq"] - 1 / e["xd"]) * np.sin(2 * angle)
    _, after = evaluate(Subtransient, x, named, p)
    # Two routes to one number of size 1 in double precision.
    assert after["Pe"][0] == pytest.approx(excitation + reluctance, abs=1e-13)
    assert after["Pm"][0] == pytest.approx(after["Pe"][0], abs=1e-13)


def test_the_voltage_behind_the_impedance_and_the_terminal_give_the_current_of_the_start() -> None:
    """What the machine injects must be what the power flow asked of it."""
    p, named = parameters(Subtransient, 2), signals(2)
    x = Subtransient.initialise(named, p)
    _, after = evaluate(Subtransient, x, named, p)
    inner = after["Epp_re"] + 1j * after["Epp_im"]
    v = named["v_re"] + 1j * named["v_im"]
    current = (inner - v) / Subtransient.impedance(p)
    expected = named["i_re"] + 1j * named["i_im"]
    # The impedance of 0.18 pu magnifies the roundings fivefold.
    np.testing.assert_allclose(current, expected, rtol=0, atol=1e-14 * 20)


def test_copper_loss_is_part_of_the_mechanical_power() -> None:
    """Without r_a |I|^2 the rotor would slow down from the first step."""
    p, named = parameters(Subtransient, 1), signals(1)
    x = Subtransient.initialise(named, p)
    _, after = evaluate(Subtransient, x, named, p)
    loss = e["ra"] * (named["i_re"][0] ** 2 + named["i_im"][0] ** 2)
    assert named["Pm"][0] - after["Pe"][0] == pytest.approx(loss, abs=1e-14)


@pytest.mark.parametrize("omega", [0.9, 1.1])
def test_speed_scales_the_voltage_behind_the_impedance(omega: float) -> None:
    """A machine that runs away shows it in its voltage, as the islanded G26 does."""
    p, named = parameters(Subtransient, 1), signals(1)
    x = Subtransient.initialise(named, p)
    _, rest = evaluate(Subtransient, x, named, p)
    x[X.omega] = omega
    _, moved = evaluate(Subtransient, x, named, p)
    assert moved["Epp_re"][0] == pytest.approx(omega * rest["Epp_re"][0], rel=1e-14)
    assert moved["Epp_im"][0] == pytest.approx(omega * rest["Epp_im"][0], rel=1e-14)


@pytest.mark.parametrize(
    ("symbol", "value", "text"),
    [
        ("xl", 0.19, "xl < xd_pp"),
        ("xq_p", 1.95, "xq_pp <= xq_p <= xq"),
        ("xq_pp", 0.2, "xq_pp = xd_pp"),
    ],
)
def test_reactances_out_of_order_are_refused(symbol: str, value: float, text: str) -> None:
    """x_l < x'' <= x' <= x is what makes fluxes of currents."""
    assert any(text in finding for finding in Subtransient.check({**e, symbol: value}))
