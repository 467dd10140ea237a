"""Exciters at their limits, at their initial point and against each other."""

from collections.abc import Callable

import numpy as np
import pytest

from conformance.examples import evaluate, signals
from conformance.linear import column
from grid.alone import Alone
from tieline.grid.models.base import Model
from tieline.grid.models.characteristics import rectifier, saturation
from tieline.grid.models.exciters.ac1a import AC1A
from tieline.grid.models.exciters.ac4a import AC4A
from tieline.grid.models.exciters.dc1a import DC1A
from tieline.grid.models.exciters.dc2a import DC2A
from tieline.grid.models.exciters.simple import Simple
from tieline.grid.models.exciters.st1a import ST1A
from tieline.grid.models.exciters.st3_potential import P as POTENTIAL
from tieline.grid.models.exciters.st3_potential import ST3Potential
from tieline.grid.models.exciters.st3a import ST3A, supply
from tieline.grid.models.exciters.st3a import P as ST3A_ROW
from tieline.grid.models.limits import OutsideLimitError

IFD = 3.0


def of_field(model: type[Model], level: float) -> float:
    """Return V_E at which the exciter's field takes V_R = `level`, by bisection."""
    e = model.example
    low, high = 0.0, 20.0
    for _ in range(80):
        middle = np.array([(low + high) / 2])
        S = saturation(middle, e["E1"], np.array([e["SE1"]]), e["E2"], np.array([e["SE2"]]))
        needs = (e["KE"] + S[0]) * middle[0] + e.get("KD", 0.0) * IFD
        low, high = (low, middle[0]) if needs > level else (middle[0], high)
    return low


def st3a_ceiling(vt: float) -> float:
    named = signals(1)
    terminals = [named[name] * vt / named["vt"] for name in ("v_re", "v_im")]
    terminals += [named["i_re"], named["i_im"], np.array([IFD])]
    return float(supply(*terminals, column(ST3A, ST3A.example))[0])


def ac1a_ceiling(vt: float) -> float:
    V_E = np.array([of_field(AC1A, 6.03)])
    return float(rectifier(V_E, np.array([0.2 * IFD]))[0])


CEILINGS: list[tuple[type[Model], Callable[[float], float]]] = [
    (Simple, lambda vt: 5.0),
    (ST1A, lambda vt: 7.8 * vt - 0.08 * IFD),
    (ST3A, st3a_ceiling),
    (AC4A, lambda vt: 5.64),
    (AC1A, ac1a_ceiling),
    (DC1A, lambda vt: of_field(DC1A, 1.0)),
    (DC2A, lambda vt: of_field(DC2A, 4.95 * vt)),
]


@pytest.mark.parametrize(("model", "ceiling"), CEILINGS, ids=lambda item: getattr(item, "key", ""))
def test_a_long_dip_takes_the_field_to_its_ceiling(
    model: type[Model], ceiling: Callable[[float], float]
) -> None:
    """The ceiling decides first-swing stability; each type has its own."""
    vt = 0.5
    one = Alone(model)
    dip = vt / one.named["vt"][0]
    one.set(vt=vt, Ifd=IFD, v_re=one.named["v_re"][0] * dip, v_im=one.named["v_im"][0] * dip)
    # The slowest exciter has 1.3 s; its rate feedback, 1 s, has to die out too.
    reached = one.run(25.0, step_s=0.005)["Efd"]
    assert reached == pytest.approx(ceiling(vt), rel=1e-4)


@pytest.mark.parametrize(
    ("model", "state", "limit"),
    [(Simple, "V_R", 5.0), (AC4A, "E_fd", 5.64), (DC1A, "V_R", 1.0), (AC1A, "V_A", 14.5)],
)
def test_a_regulator_leaves_its_limit_as_soon_as_the_error_turns(
    model: type[Model], state: str, limit: float
) -> None:
    """A wound-up regulator would force the field through the whole back swing."""
    one = Alone(model)
    row = model.states.index(state)
    one.set(v_s=0.5)
    one.run(0.3)
    # A step that crosses the limit leaves the state beyond it; it comes back with T_A.
    assert one.x[row, 0] == pytest.approx(limit, abs=0.005)
    one.set(v_s=-0.02)
    one.run(0.004)
    assert one.look()[0][state] < 0.0
    assert one.x[row, 0] < 0.99 * limit


def test_the_limit_of_a_bus_fed_regulator_moves_with_the_voltage() -> None:
    """DC2A's supply is the terminal voltage, DC1A's is not."""
    for model, ratio in ((DC1A, 1.0), (DC2A, 0.6)):
        one = Alone(model)
        row = model.states.index("V_R")
        one.set(vt=0.6)
        one.run(2.0)
        assert one.x[row, 0] == pytest.approx(ratio * model.example["VRmax"], rel=1e-6)


def test_at_rated_voltage_the_two_dc_exciters_are_one() -> None:
    """They differ in the supply of the regulator alone."""
    at_rated = {"vt": 1.0, "v_re": 1.0, "v_im": 0.0}
    pair = [Alone(model, DC1A.example, at_rated) for model in (DC1A, DC2A)]
    for one in pair:
        one.set(v_s=0.02)
        one.run(1.0)
    np.testing.assert_array_equal(pair[0].x, pair[1].x)


def test_st3a_without_inner_loop_current_source_and_loading_is_st3_potential() -> None:
    """The miniWECC's exciter is a special case of the standard's."""
    values = {
        **ST3A.example, "KI": 0.0, "KC": 0.0, "KG": 0.0, "XL": 0.0, "KM": 1.0, "TM": 0.0,
        "KP": 1.1, "VMmax": 99.0, "VMmin": -99.0, "VBmax": 99.0,
    }  # fmt: skip
    values |= {"TA": 0.02, "VRmax": 5.0, "VRmin": -5.0, "VImax": 0.1, "VImin": -0.1}
    simpler = {name: values.get(name, 99.0) for name in POTENTIAL._fields}
    full, special = column(ST3A, values), column(ST3Potential, simpler)
    states = (np.array([[0.02], [2.0]]), np.array([[0.04], [5.0]]), np.array([[-0.1], [-5.0]]))
    for v_s, x in zip((0.01, 0.3, -0.3), states, strict=True):
        named = signals(1) | {"v_s": np.array([v_s]), "Vref": np.array([1.04])}
        dx, after = evaluate(ST3A, np.vstack([[1.0], x, [0.0]]), named, full)
        dx_special, after_special = evaluate(ST3Potential, x, named, special)
        np.testing.assert_array_equal(dx[1:3], dx_special)
        # |K_P V| and K_P |V| are rounded apart.
        assert after["Efd"][0] == pytest.approx(after_special["Efd"][0], rel=1e-14)


def test_the_supply_of_st3a_adds_voltage_and_current_as_phasors() -> None:
    """A compound source holds the field up while a fault takes the voltage away."""
    values = {**ST3A.example, "KI": 4.83, "theta_P": 20.0, "KC": 1.1, "VBmax": 99.0}
    named = signals(1)
    V = named["v_re"][0] + 1j * named["v_im"][0]
    current = named["i_re"][0] + 1j * named["i_im"][0]
    K_P = 6.15 * np.exp(1j * np.deg2rad(20.0))
    V_E = abs(K_P * V + 1j * (4.83 + K_P * 0.081) * current)
    I_N = 1.1 * 2.1 / V_E
    terminals = (named[name] for name in ("v_re", "v_im", "i_re", "i_im", "Ifd"))
    found = supply(*terminals, column(ST3A, values))[0]
    assert np.sqrt(3) / 4 * V_E > 1.1 * 2.1
    assert found == pytest.approx(V_E * (1 - I_N / np.sqrt(3)), rel=1e-14)


@pytest.mark.parametrize("v_s", [0.005, 0.1, -0.05])
def test_the_algebraic_inner_loop_solves_its_own_equation(v_s: float) -> None:
    """T_M = 0 closes a loop without a state: V_M = K_M (V_R - min(K_G E_fd, V_G max))."""
    one = Alone(ST3A, {"TM": 0.0, "KM": 0.1, "VMmax": 0.9})
    one.set(v_s=v_s)
    one.run(0.5)
    Efd = one.look()[1]["Efd"]
    named = (one.named[name] for name in ("v_re", "v_im", "i_re", "i_im", "Ifd"))
    V_M = Efd / supply(*named, one.p)[0]
    V_L = one.x[1, 0] + (one.named["Vref"][0] - one.named["vt"][0] + v_s - one.x[1, 0]) / 10.0
    V_R = np.clip(200.0 * V_L, one.p[ST3A_ROW.VRmin, 0], one.p[ST3A_ROW.VRmax, 0])
    expected = np.clip(0.1 * (V_R - min(Efd, 5.8)), 0.0, 0.9)
    np.testing.assert_allclose(V_M, expected, rtol=1e-12)


def test_an_inner_loop_with_little_lag_tends_to_the_algebraic_one() -> None:
    """The bypass must be the limit of the block that it replaces."""
    ends = []
    for TM in (0.0, 0.01):
        one = Alone(ST3A, {"TM": TM})
        one.set(v_s=0.01)
        # The loop closes the lag to 0.01 s / (1 + K_M K_G V_B) = 0.2 ms.
        ends.append(one.run(0.4, step_s=2e-4)["Efd"])
    # All that is left then is the slow transient gain reduction.
    assert ends[1] == pytest.approx(ends[0], rel=1e-4)


def test_the_field_current_limiter_of_st1a_takes_what_exceeds_its_setting() -> None:
    """K_LR (I_fd - I_LR) comes off the regulator, and only above I_LR."""
    one = Alone(ST1A, {"KLR": 4.54, "ILR": 4.4})
    before = one.look()[1]["Efd"]
    one.set(Ifd=4.3)
    assert one.look()[1]["Efd"] == before
    one.set(Ifd=4.5)
    assert one.look()[1]["Efd"] == pytest.approx(before - 4.54 * 0.1, rel=1e-13)


def test_the_field_current_loads_the_alternator_of_ac1a() -> None:
    """K_D I_fd demagnetises the exciter at once; so more field current needs more V_R."""
    one = Alone(AC1A)
    _, before = one.look()
    rate = one.look()[0]["V_E"]
    one.set(Ifd=before["Ifd"] + 1.0)
    assert one.look()[0]["V_E"] - rate == pytest.approx(-0.38 / 0.8, rel=1e-12)
    assert one.look()[1]["Efd"] == pytest.approx(before["Efd"] - 0.2 / np.sqrt(3), rel=1e-12)


@pytest.mark.parametrize(
    ("model", "changes", "text"),
    [
        (Simple, {"VRmax": 2.0}, "Efd = 2.1 at the start, outside [-5, 2]"),
        (ST1A, {"VRmax": 2.0}, "Efd = 2.1 at the start"),
        (ST1A, {"VAmax": 2.0}, "V_A = 2.1 at the start"),
        (ST1A, {"VImax": 0.01}, "V_I = 0.01105 at the start"),
        (ST3A, {"VMmax": 0.3}, "V_M = 0.34"),
        (ST3A, {"VRmax": 2.0}, "V_R = 2.1"),
        (AC4A, {"VRmax": 2.2, "KC": 0.1}, "outside [-4.53, 1.99]"),
        (AC1A, {"VRmax": 3.0}, "V_R = 3.1"),
        (AC1A, {"VAmax": 3.0}, "V_A = 3.1"),
        (DC1A, {"VRmax": 0.1}, "V_R = 0.1"),
        (DC1A, {"Efdmin": 2.2}, "Efd = 2.1 at the start, outside [2.2, inf]"),
        (DC2A, {"VRmax": 2.2}, "V_R = 2."),
    ],
)
def test_an_operating_point_beyond_a_limit_names_it(
    model: type[Model], changes: dict[str, float], text: str
) -> None:
    """Started beyond a limit, a unit would drift from the first step for no visible reason."""
    with pytest.raises(OutsideLimitError) as caught:
        Alone(model, changes)
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("model", "changes", "text"),
    [
        (Simple, {"TC": 1.0}, "needs TB > 0 s"),
        (ST1A, {"TC1": 1.0}, "needs TB1 > 0 s"),
        (ST1A, {"KF": 0.1}, "needs TA > 0 s beside KF > 0"),
        (ST1A, {"VAmin": 100.0}, "needs VAmin < VAmax"),
        (ST3A, {"VMmin": 1.0}, "needs VMmin < VMmax"),
        (ST3A, {"KP": 0.0}, "needs KP > 0 or KI > 0"),
        (DC1A, {"E1": 3.2}, "needs E1 < E2"),
        (DC2A, {"SE1": 0.3}, "needs SE1/E1 <= SE2/E2"),
        (AC1A, {"VRmin": 7.0}, "needs VRmin < VRmax"),
    ],
)
def test_contradicting_exciter_data_are_refused(
    model: type[Model], changes: dict[str, float], text: str
) -> None:
    """Each would divide by zero, or do the opposite of what its author meant."""
    assert any(text in finding for finding in model.check({**model.example, **changes}))
