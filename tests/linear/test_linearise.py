"""The matrices of a linear system against differences of the equations that are integrated."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from grid.runs import with_values
from linear.sampled import by_inputs, by_states, copy_of_work, flows, held, outputs
from tieline.errors import InputError
from tieline.grid.case import Case, load_case
from tieline.grid.devices import with_pss
from tieline.grid.load_mix import with_load_mix
from tieline.grid.plan import ROTORS
from tieline.grid.powerflow import PowerFlow, solve_power_flow
from tieline.grid.settings import LoadSettings, PssSettings
from tieline.grid.system import System, build_system, rotor_average, sensor_average
from tieline.linear.linearise import LinearSystem, linearise
from tieline.linear.names import BUS_INPUTS, BUS_OUTPUTS, PMU_OUTPUT, UNIT_INPUTS, UNIT_OUTPUTS
from tieline.resources import case_folder

Floats = NDArray[np.float64]
Grids = dict[str, tuple[Case, PowerFlow]]

MIX = LoadSettings(
    p_constant_power=0.4,
    p_constant_current=0.3,
    q_constant_power=0.2,
    q_constant_current=0.5,
    p_frequency=1.5,
    q_frequency=-1.0,
)
"""Every term of a load, each unlike the others."""

WITHOUT_PSS = "G3"

BY_STATE, BY_INPUT = 1e-7, 1e-6
"""Of the largest entry of a row: `sampled.MOVE` and `sampled.DRAWN` say what limits a sample."""

EQUAL = 1e-12
"""The same samples, summed in another order."""


def built(grids: Grids, name: str, average: str, units: Sequence[str]) -> System:
    """A case with the generalised stabiliser in some units."""
    case, flow = grids[name]
    fitted = with_pss(case, PssSettings(gain=9.0, beta1=1.0, beta2=0.5, units=list(units)))
    # Unequal weights, so that no member can stand for another.
    weights = 1.0 + np.arange(len(case.base.sensors if average == "sensors" else case.units))
    of = sensor_average(weights) if average == "sensors" else rotor_average(weights)
    return build_system(fitted, flow, case.base.sensors, of)


@pytest.fixture(scope="module")
def grids() -> Grids:
    """Three cases by name.

    The two-area system as it is; the same with exciters that pass on at once what they are given;
    and the miniWECC with loads that answer to everything.
    """
    two_area = load_case(case_folder("two_area"))
    base = two_area.base.model_copy(update={"name": "at_once"})
    at_once = with_values(replace(two_area, base=base), "exciter", TA=0.0)
    miniwecc = with_load_mix(load_case(case_folder("miniwecc")), MIX)
    return {case.name: (case, solve_power_flow(case)) for case in (two_area, at_once, miniwecc)}


@pytest.fixture(
    scope="module",
    params=[
        ("two_area", "sensors"),
        ("two_area", "rotors"),
        ("at_once", "rotors"),
        ("miniwecc", "sensors"),
        ("miniwecc", "rotors"),
    ],
    ids="-".join,
)
def system(request: pytest.FixtureRequest, grids: Grids) -> System:
    """A system with either average, in which one unit has no stabiliser."""
    name, average = request.param
    units = [unit for unit in grids[name][0].units if unit != WITHOUT_PSS]
    return built(grids, name, average, units)


@pytest.fixture(scope="module")
def linear(system: System) -> LinearSystem:
    return linearise(system)


@pytest.fixture(scope="module")
def two_area(grids: Grids) -> LinearSystem:
    return linearise(built(grids, "two_area", "sensors", ["G1", "G2", "G4"]))


def assert_close(found: Floats, expected: Floats, names: Sequence[str], bound: float) -> None:
    """Compare row by row, relative to the largest entry of a row; zeros must be zeros."""
    assert found.shape == expected.shape
    scale = np.abs(expected).max(axis=1)
    error = np.abs(found - expected).max(axis=1)
    wrong = [name for name, e, s in zip(names, error, scale, strict=True) if e > bound * s]
    assert not wrong, f"{wrong[:5]} of {len(wrong)}: {error.max():.1e}"


def test_names_are_those_of_what_can_be_moved_and_read(linear: LinearSystem) -> None:
    """A user asks by name; a name at the wrong row would answer for another element."""
    system = linear.system
    assert tuple(outputs(system, copy_of_work(system), system.x0)) == linear.outputs
    assert linear.states == system.labels
    kinds = {name.partition(".")[0] for name in linear.inputs}
    assert kinds == {*UNIT_INPUTS, *BUS_INPUTS}
    kinds = {name.partition(".")[0] for name in linear.outputs}
    assert kinds == {*UNIT_OUTPUTS, "pss", *BUS_OUTPUTS, PMU_OUTPUT, "p_pu", "coi", "wbar"}


def test_states_and_outputs_follow_every_state(linear: LinearSystem) -> None:
    """Every mode, shape and response rests on A and C."""
    A, C = by_states(linear.system, linear.system.plan)
    assert_close(linear.A, A, linear.states, BY_STATE)
    assert_close(linear.C(linear.outputs), C, linear.outputs, BY_STATE)


def test_with_the_average_held_they_follow_the_rest(linear: LinearSystem) -> None:
    """Margins against delay open the loop here: what is left must not contain it."""
    A, C = by_states(linear.system, held(linear.system.plan))
    assert_close(linear.A_without_average, A, linear.states, BY_STATE)
    rows, believed = linear.C_without_average(linear.outputs)
    # The last output is the average itself: of no state, and wholly of the average.
    assert_close(rows[:-1], C[:-1], linear.outputs[:-1], BY_STATE)
    assert not rows[-1].any()
    assert believed[-1] == 1.0


def test_states_and_outputs_follow_every_input(linear: LinearSystem) -> None:
    """A probing signal or a load step must act where and as it does in a run.

    The miniWECC's buses are taken by fives: loads, HVDC terminals and bare ones are among them.
    """
    case = linear.system.case
    buses = [f"B{number}" for number in case.buses.number][:: 5 if case.name == "miniwecc" else 1]
    for kind in (*UNIT_INPUTS, *BUS_INPUTS):
        elements = buses if kind in BUS_INPUTS else case.units
        names = [f"{kind}.{element}" for element in elements]
        # Another exciter's input would be overwritten by its own stabiliser.
        names = [f"vs.{WITHOUT_PSS}"] if kind == "vs" else names
        B, D = by_inputs(linear.system, names)
        assert B.any(), kind
        assert_close(linear.B(names), B, linear.states, BY_INPUT)
        assert_close(linear.D(linear.outputs, names), D, linear.outputs, BY_INPUT)


def test_what_each_unit_believes_is_an_input(linear: LinearSystem) -> None:
    """A delay from sensor to unit stands between the average and what this unit believes of it."""
    names = [f"wbar.{unit}" for unit in linear.system.case.units]
    np.testing.assert_array_equal(linear.by_believed, linear.B(names))
    _, believed = linear.C_without_average(linear.outputs)
    D = linear.D(linear.outputs[:-1], names).sum(axis=1)
    np.testing.assert_allclose(believed[:-1], D, rtol=EQUAL)


def test_a_signal_at_an_exciter_adds_to_its_stabilisers(grids: Grids, system: System) -> None:
    """A step at the summing junction is how a plant tests a stabiliser in service."""
    average = "rotors" if system.plan.average.mode == ROTORS else "sensors"
    bare = built(grids, system.case.name, average, [])
    names = [f"vs.{unit}" for unit in system.case.units]
    linear, B_and_D = linearise(system), by_inputs(bare, names)
    B, keep = linear.B(names), np.isin(system.labels, bare.labels)
    assert_close(B[keep], B_and_D[0], bare.labels, BY_INPUT)
    # What a stabiliser reads does not move at once.
    assert not B[~keep].any()
    assert_close(linear.D(linear.outputs, names), B_and_D[1], linear.outputs, BY_INPUT)


def test_linearising_leaves_the_system_as_it_was(system: System) -> None:
    """A run may start from the same system."""
    x, before = system.x0.copy(), copy_of_work(system)
    linear = linearise(system)
    assert linear.A.any()
    np.testing.assert_array_equal(system.x0, x)
    for now, then in zip(system.work, before, strict=True):
        np.testing.assert_array_equal(now, then)


def test_the_samples_read_the_power_of_a_branch_at_its_from_end(grids: Grids) -> None:
    """The comparison of `p_pu` needs a flow that was not worked out by the code under test."""
    case, flow = grids["two_area"]
    power = dict(zip(case.branches.name, flows(case, flow.phasor), strict=True))
    given = dict(zip(case.buses.number.tolist(), case.buses.p_gen, strict=True))
    # What the unit at the slack bus gives is in no table.
    for branch in ("1-10", "11-110", "12-120"):
        assert power[branch] == pytest.approx(given[int(branch.partition("-")[0])], rel=1e-9)


def test_a_cut_stabiliser_leaves_the_system_without_it(grids: Grids, system: System) -> None:
    """An open loop that is still closed somewhere would give wrong margins."""
    whole, cut = linearise(system), linearise(system, ["G1"])
    average = "rotors" if system.plan.average.mode == ROTORS else "sensors"
    others = [unit for unit in system.case.units if unit not in ("G1", WITHOUT_PSS)]
    plain = linearise(built(grids, system.case.name, average, others))
    keep = np.isin(system.labels, plain.states)
    assert set(np.array(system.labels)[~keep]) == {
        label for label in system.labels if label.startswith("pss.") and label.endswith(".G1")
    }
    assert_close(cut.A[np.ix_(keep, keep)], plain.A, plain.states, EQUAL)
    assert not cut.A[np.ix_(keep, ~keep)].any()
    assert whole.A[np.ix_(keep, ~keep)].any()
    names = [name for name in plain.outputs if name != "pss.G1"]
    assert_close(cut.C(names)[:, keep], plain.C(names), names, EQUAL)
    inputs = ["Vref.G1", "vs.G1", "w0.G2", "wbar.G2", "p_load.B1"]
    assert_close(cut.B(inputs)[keep], plain.B(inputs), plain.states, EQUAL)
    assert_close(cut.D(names, inputs), plain.D(names, inputs), names, EQUAL)


def test_the_output_of_a_cut_stabiliser_can_be_seen(system: System) -> None:
    """The response of an open loop is measured at it."""
    whole, cut = linearise(system), linearise(system, system.case.units)
    names = [f"pss.{unit}" for unit in system.case.units]
    np.testing.assert_array_equal(cut.C(names), whole.C(names))
    fitted = [name for name in names if name != f"pss.{WITHOUT_PSS}"]
    assert cut.C(fitted).any(axis=1).all()
    assert not cut.C([f"pss.{WITHOUT_PSS}"]).any()


UNKNOWN_INPUTS = {
    "Vreff.G1": r"no input 'Vreff\.G1'; did you mean 'Vref\.G1'\?",
    "Vref.G11": r"'Vref\.G11': no unit 'G11'; did you mean 'G1'\?",
    "p_load.B111": r"'p_load\.B111': no bus 'B111'; did you mean 'B11'\?",
    "q_load.101": r"'q_load\.101': no bus '101'; did you mean 'B101'\?",
}
UNKNOWN_OUTPUTS = {
    "sped.G1": r"no output 'sped\.G1'; did you mean 'speed\.G1'\?",
    "speed.g1": r"'speed\.g1': no unit 'g1'",
    "pss.G11": r"'pss\.G11': no unit 'G11'; did you mean 'G1'\?",
    "v_pu.B111": r"'v_pu\.B111': no bus 'B111'; did you mean 'B11'\?",
    "f_hz.B111": r"'f_hz\.B111': no bus 'B111'; did you mean 'B11'\?",
    "f_hz.B1": r"'f_hz\.B1': bus 1 has no PMU",
    "p_pu.10-2": r"no branch '10-2'; did you mean '10-20'\?",
    "coi.G1": r"no output 'coi\.G1'",
}


@pytest.mark.parametrize("name", UNKNOWN_INPUTS)
def test_an_unknown_input_is_refused_with_the_nearest(two_area: LinearSystem, name: str) -> None:
    """Names are typed by hand, and a bus without its B is the usual slip."""
    for matrix in (two_area.B, partial(two_area.D, ["coi"])):
        with pytest.raises(InputError, match=UNKNOWN_INPUTS[name]):
            matrix(["Vref.G1", name])


@pytest.mark.parametrize("name", UNKNOWN_OUTPUTS)
def test_an_unknown_output_is_refused_with_the_nearest(two_area: LinearSystem, name: str) -> None:
    """A row of zeros for a name that is nothing would look like an answer."""
    calls: list[Callable[[Sequence[str]], object]] = [two_area.C, two_area.C_without_average]
    for matrix in (*calls, lambda names: two_area.D(names, ["Vref.G1"])):
        with pytest.raises(InputError, match=UNKNOWN_OUTPUTS[name]):
            matrix(["coi", name])


def test_an_unknown_unit_cannot_be_cut(two_area: LinearSystem) -> None:
    """The loop that was meant would stay closed."""
    with pytest.raises(InputError, match=r"no unit 'G11'; did you mean 'G1'\?"):
        linearise(two_area.system, ["G11"])
