"""The saturated, transient and classical machines and the infinite bus, against formulas."""

import numpy as np
import pytest

from conformance.examples import evaluate, parameters, signals
from conformance.linear import column
from tieline.grid.models.machines.classical import Classical
from tieline.grid.models.machines.infinite_bus import InfiniteBus
from tieline.grid.models.machines.subtransient import Subtransient
from tieline.grid.models.machines.subtransient_saturated import P, SubtransientSaturated, X
from tieline.grid.models.machines.transient import Transient

MACHINES = [Subtransient, SubtransientSaturated, Transient, Classical, InfiniteBus]


def test_without_saturation_the_saturated_machine_is_the_other_to_the_last_bit() -> None:
    """Two models of one machine would let a result depend on which of them a table names."""
    p, named = parameters(SubtransientSaturated, 3), signals(3)
    p[P.S10] = p[P.S12] = 0.0
    plain = p[: len(Subtransient.parameters)].copy()
    x = Subtransient.initialise(signals(3), plain)
    # The rotor angle is found along another route.
    np.testing.assert_allclose(SubtransientSaturated.initialise(named, p), x, rtol=0, atol=1e-14)
    x = x + 0.05 * np.random.default_rng(1).normal(size=x.shape)
    dx, after = evaluate(Subtransient, x, signals(3), plain)
    dx_saturated, after_saturated = evaluate(SubtransientSaturated, x, signals(3), p)
    np.testing.assert_array_equal(dx_saturated, dx)
    for name in ("Pe", "Ifd", "i_re", "i_im", "Epp_re", "Epp_im"):
        np.testing.assert_array_equal(after_saturated[name], after[name])


@pytest.mark.parametrize(("v", "field"), [(1.0, 1.0 * (1 + 0.05)), (1.2, 1.2 * (1 + 0.3))])
def test_the_open_circuit_curve_passes_through_its_two_points(v: float, field: float) -> None:
    """S(1.0) and S(1.2) are read off that very curve."""
    p, named = column(SubtransientSaturated, SubtransientSaturated.example), signals(1)
    named |= {name: np.zeros(1) for name in ("v_im", "i_re", "i_im")}
    named |= {"v_re": np.array([v])}
    SubtransientSaturated.initialise(named, p)
    assert named["Efd"][0] == pytest.approx(field, rel=1e-13)
    assert named["Ifd"][0] == named["Efd"][0]


def test_saturation_takes_field_and_turns_the_rotor_back() -> None:
    """A saturated machine needs more field, and its q-axis reactance is smaller."""
    named, saturated = signals(1), signals(1)
    x = Subtransient.initialise(named, column(Subtransient, Subtransient.example))
    p = column(SubtransientSaturated, SubtransientSaturated.example)
    y = SubtransientSaturated.initialise(saturated, p)
    assert saturated["Efd"][0] > named["Efd"][0]
    assert y[X.delta, 0] < x[X.delta, 0]


@pytest.mark.parametrize("machine", [Transient, Classical, SubtransientSaturated])
def test_at_rest_power_and_current_are_those_of_the_power_flow(machine: type) -> None:
    """What the machine injects must be what the power flow asked of it."""
    p, named = parameters(machine, 2), signals(2)
    x = machine.initialise(named, p)
    _, after = evaluate(machine, x, named, p)
    v = named["v_re"] + 1j * named["v_im"]
    i = named["i_re"] + 1j * named["i_im"]
    np.testing.assert_allclose(after["i_re"] + 1j * after["i_im"], i, rtol=0, atol=1e-14 * 20)
    np.testing.assert_allclose(after["Pe"], (v * i.conj()).real, rtol=0, atol=1e-13)


def test_the_transient_machine_at_rest_follows_the_power_angle_formula() -> None:
    """P = E V sin(delta') / x_d + V^2 (1/x_q - 1/x_d) sin(2 delta') / 2, Kundur equation 3.133."""
    e = {**Transient.example, "ra": 0.0}
    p, named = column(Transient, e), signals(1)
    x = Transient.initialise(named, p)
    v = named["v_re"][0] + 1j * named["v_im"][0]
    angle = x[0, 0] - np.angle(v)
    power = named["Efd"][0] * abs(v) * np.sin(angle) / e["xd"]
    power += abs(v) ** 2 / 2 * (1 / e["xq"] - 1 / e["xd"]) * np.sin(2 * angle)
    assert named["Pm"][0] == pytest.approx(power, abs=1e-13)


def test_the_classical_machine_follows_the_power_angle_formula() -> None:
    """P = E' V sin(delta) / x'_d, wherever the rotor stands."""
    p, named = column(Classical, Classical.example), signals(1)
    x = Classical.initialise(named, p)
    x[0] += 0.3
    _, after = evaluate(Classical, x, named, p)
    v = named["v_re"][0] + 1j * named["v_im"][0]
    angle = x[0, 0] - np.angle(v)
    power = named["Efd"][0] * abs(v) * np.sin(angle) / Classical.example["xd_p"]
    assert after["Pe"][0] == pytest.approx(power, abs=1e-13)


def test_an_infinite_bus_stands_still_whatever_it_delivers() -> None:
    """It is the fixed point against which a single machine swings."""
    p, named = column(InfiniteBus, InfiniteBus.example), signals(1)
    x = InfiniteBus.initialise(named, p)
    dx, after = evaluate(InfiniteBus, x, {**named, "v_im": named["v_im"] - 0.01}, p)
    np.testing.assert_array_equal(dx, 0.0)
    assert after["Pe"][0] > 5.0
    assert after["omega"][0] == 1.0


def test_only_an_infinite_bus_has_no_inertia() -> None:
    """It would hold every average of speeds at 1, were it counted."""
    for machine in MACHINES:
        expected = machine.example.get("H", 0.0)
        assert machine.inertia(column(machine, machine.example)).tolist() == [expected]


@pytest.mark.parametrize(
    ("machine", "changes", "text"),
    [
        (Transient, {"xq_p": 0.4}, "needs xq_p = xd_p"),
        (Transient, {"xd_p": 1.9, "xq_p": 1.9}, "needs xd_p <= xd"),
        (SubtransientSaturated, {"S10": 0.3, "S12": 0.3}, "needs S10/1.0 <= S12/1.2"),
        (SubtransientSaturated, {"xl": 0.19}, "needs xl < xd_pp"),
    ],
)
def test_contradicting_machine_data_are_refused(
    machine: type, changes: dict[str, float], text: str
) -> None:
    """Equations for x'_q = x'_d, run on other data, would give a plausible wrong answer."""
    assert any(text in finding for finding in machine.check({**machine.example, **changes}))
