"""Governors: droop, limits, deadband, water and temperature."""

import numpy as np
import pytest

from grid.alone import Alone
from tieline.grid.models.base import Model
from tieline.grid.models.governors.gast import GAST
from tieline.grid.models.governors.hygov import HYGOV
from tieline.grid.models.governors.ieeeg1 import IEEEG1
from tieline.grid.models.governors.tgov1 import TGOV1
from tieline.grid.models.limits import OutsideLimitError

GOVERNORS = [TGOV1, IEEEG1, HYGOV, GAST]
QUICK = {HYGOV: {"Tr": 1.0}}
"""What makes the slowest mode of a governor 10 s at most: that of HYGOV is (r + R) Tr / R."""


@pytest.mark.parametrize(
    ("model", "gain"),
    [
        (TGOV1, 1 / 0.05),
        (IEEEG1, 25.0),
        # D_turb acts on the gate's opening of 0.8 / 1.2 + 0.08, which grows by 0.001 / 0.04.
        (HYGOV, 1.2 / 0.04 + 0.5 * (0.8 / 1.2 + 0.08 + 0.001 / 0.04)),
        (GAST, 1 / 0.04 + 0.18),
    ],
)
def test_a_lasting_speed_deviation_moves_the_power_by_the_droop(
    model: type[Model], gain: float
) -> None:
    """Where the frequency settles after a loss of generation is decided by this."""
    one = Alone(model, QUICK.get(model))
    one.set(omega=0.999)
    end = one.run(100.0, step_s=0.04)
    assert end["Pm"] - 0.8 == pytest.approx(0.001 * gain, rel=1e-3)


@pytest.mark.parametrize("model", GOVERNORS)
def test_a_step_of_the_reference_moves_the_power_by_as_much(model: type[Model]) -> None:
    """P_ref is a power in every governor, so that one event means the same for all."""
    one = Alone(model, QUICK.get(model))
    one.set(Pref=one.named["Pref"][0] + 0.05)
    end = one.run(100.0, step_s=0.04)
    assert end["Pm"] == pytest.approx(0.85, rel=1e-4)


@pytest.mark.parametrize(
    ("model", "state", "most"),
    [(TGOV1, "valve", 1.0), (IEEEG1, "valve", 1.0), (HYGOV, "demand", 1.0), (GAST, "valve", 1.0)],
)
def test_a_valve_stays_at_its_limit_and_leaves_it_at_once(
    model: type[Model], state: str, most: float
) -> None:
    """A governor that wound up would hold the valve open long after the frequency is back."""
    one = Alone(model, {"AT": 2.0} if model is GAST else {})
    one.set(omega=0.95)
    one.run(20.0, step_s=0.02)
    row = model.states.index(state)
    # Heun's stage may overshoot by the rate times a step.
    assert one.x[row, 0] == pytest.approx(most, abs=0.03)
    assert one.look()[0][state] == 0.0
    one.set(omega=1.05)
    one.run(0.02, step_s=0.01)
    assert one.look()[0][state] < 0.0
    assert one.x[row, 0] < most


def test_the_rate_limits_of_a_steam_valve_hold_on_both_sides() -> None:
    """Boilers do not follow a valve that opens in no time."""
    one = Alone(IEEEG1, {"Uo": 0.1, "Uc": -0.2})
    one.set(omega=0.99)
    assert one.look()[0]["valve"] == 0.1
    one.set(omega=1.01)
    assert one.look()[0]["valve"] == -0.2


def test_the_gate_moves_no_faster_than_its_servo_allows() -> None:
    """A gate that closes faster bursts the penstock."""
    one = Alone(HYGOV)
    fastest = []
    one.set(omega=0.98)
    one.run(2.0, watch=lambda: fastest.append(one.look()[0]["demand"]))
    assert max(fastest) == pytest.approx(0.2, abs=1e-15)


@pytest.mark.parametrize(("omega", "moved"), [(0.9995, 0.0), (1.0005, 0.0), (0.999, 0.0004)])
def test_the_deadband_of_a_steam_governor_ignores_small_deviations(
    omega: float, moved: float
) -> None:
    """36 mHz on either side, the usual setting, leaves the valve alone."""
    one = Alone(IEEEG1, {"db1": 0.0006})
    one.set(omega=omega)
    assert one.run(60.0, step_s=0.02)["Pm"] - 0.8 == pytest.approx(25.0 * moved, abs=1e-6)


def test_a_gas_turbine_gives_way_to_its_temperature_limit() -> None:
    """In a low frequency it opens fully at first, and then falls back to what its blades bear."""
    one = Alone(GAST, {"AT": 0.85})
    one.set(omega=0.97)
    powers = []
    end = one.run(60.0, step_s=0.01, watch=lambda: powers.append(one.look()[1]["Pm"]))
    damping = 0.18 * 0.03
    assert max(powers) > 0.9 + damping
    assert end["Pm"] == pytest.approx(0.85 + damping, rel=1e-6)


def test_a_water_column_answers_the_wrong_way_at_first() -> None:
    """Opening a gate takes head from the turbine before the water has sped up."""
    one = Alone(HYGOV)
    gate, flow = one.x[2, 0], one.x[3, 0]
    assert gate == flow == pytest.approx(0.8 / 1.2 + 0.08, rel=1e-15)
    one.set(omega=0.99)
    assert one.run(0.3)["Pm"] - 0.5 * 0.01 * one.x[2, 0] < 0.8


@pytest.mark.parametrize(
    ("model", "changes", "text"),
    [
        (TGOV1, {"VMAX": 0.7}, "Pm = 0.8 at the start, outside [0, 0.7]"),
        (IEEEG1, {"PMAX": 0.7}, "valve = 0.8 at the start, outside [0, 0.7]"),
        (HYGOV, {"GMAX": 0.7}, "gate = 0.7467 at the start, outside [0, 0.7]"),
        (GAST, {"VMIN": 0.9}, "Pm = 0.8 at the start, outside [0.9, 1]"),
        (GAST, {"AT": 0.7}, "Pm (temperature limit) = 0.8 at the start, outside [-inf, 0.7]"),
    ],
)
def test_a_power_beyond_a_limit_names_it(
    model: type[Model], changes: dict[str, float], text: str
) -> None:
    """A turbine that starts above its gate would drift from the first step."""
    with pytest.raises(OutsideLimitError) as caught:
        Alone(model, changes)
    assert str(caught.value) == text


@pytest.mark.parametrize(
    ("model", "changes", "text"),
    [
        (TGOV1, {"VMIN": 1.0}, "needs VMIN < VMAX"),
        (IEEEG1, {"K1": 0.3}, "needs K1 + ... + K8 = 1 (got 1.1)"),
        (IEEEG1, {"T2": 1.0}, "needs T1 > 0 s"),
        (HYGOV, {"r": 0.03}, "needs R < r"),
        (GAST, {"VMAX": -0.1, "VMIN": 0.0}, "needs VMIN < VMAX"),
    ],
)
def test_contradicting_governor_data_are_refused(
    model: type[Model], changes: dict[str, float], text: str
) -> None:
    """Shares of power that sum to 1.1 make a tenth of the power out of nothing."""
    assert any(text in finding for finding in model.check({**model.example, **changes}))


def test_both_shafts_of_a_tandem_unit_count() -> None:
    """Data of a cross-compound unit on one machine must not lose the low-pressure half."""
    shares = {"K1": 0.1, "K2": 0.1, "K3": 0.1, "K4": 0.2, "K5": 0.2, "K6": 0.3}
    one, other = Alone(IEEEG1, shares), Alone(IEEEG1)
    for unit in (one, other):
        unit.set(omega=0.999)
        unit.run(3.0)
    assert one.look()[1]["Pm"] == pytest.approx(other.look()[1]["Pm"], rel=1e-14)
    assert np.isfinite(one.x).all()
