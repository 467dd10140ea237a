"""Root loci: modes followed along a setting, and the paper's statements on beta1 and beta2."""

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.linear import Study, Sweep, linearise, sweep
from tieline.linear.retune import retuned

STUDY = Study("two_area", gain=25, beta1=0.5, beta2=0.5, average="rotor")
NONE_TO_ONE = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]


@pytest.fixture(scope="module")
def beta1() -> Sweep:
    return sweep(Study("two_area", gain=25, beta2=0.0, average="rotor"), "beta1", NONE_TO_ONE)


@pytest.fixture(scope="module")
def beta2() -> Sweep:
    return sweep(Study("two_area", gain=25, beta1=0.5, average="rotor"), "beta2", NONE_TO_ONE)


def test_beta1_moves_inter_area_and_local_modes_left_and_leaves_frequency_regulation(
    beta1: Sweep,
) -> None:
    """The paper's first statement on the tuning."""
    for kind in ("inter-area", "local"):
        assert np.all(np.diff(beta1.track_of(kind).eigenvalues.real) < -0.01)
    slow = beta1.track_of("frequency regulation").eigenvalues
    assert np.abs(slow - slow[0]).max() < 0.01 * abs(slow[0])


def test_beta2_does_the_reverse(beta2: Sweep) -> None:
    """The paper's second one: frequency regulation moves, until over-damped; inter-area stays."""
    between = beta2.track_of("inter-area").eigenvalues
    assert np.abs(between - between[0]).max() < 0.01 * abs(between[0])
    slow = beta2.track_of("frequency regulation")
    assert slow.damping_ratio[0] < 0.4
    assert np.all(slow.damping_ratio[2:] == 1.0)


def test_a_mode_is_followed_through_its_split_to_the_slower_real_eigenvalue(beta2: Sweep) -> None:
    """The faster one soon joins another and swings again: it is no longer this mode."""
    slow = beta2.track_of("frequency regulation")
    assert slow.frequency_hz[1] > 0.05
    real = slow.eigenvalues[2:]
    assert np.all(real.imag == 0.0)
    assert np.all(np.diff(real.real) > 0)
    assert real[-1].real == pytest.approx(-0.280, abs=1e-3)


def test_few_points_lead_to_the_same_ends_as_many(beta2: Sweep) -> None:
    """Continuation must not depend on where one happens to look.

    The two local modes are left out: near beta2 = 0.5 they come as close as 0.02 1/s and exchange
    their shapes, so that which of them is which beyond is a matter of the step.
    """
    fine = sweep(
        Study("two_area", gain=25, beta1=0.5, average="rotor"), "beta2", np.linspace(0, 1, 21)
    )
    for kind in ("frequency regulation", "inter-area"):
        one, other = (found.track_of(kind).eigenvalues[-1] for found in (beta2, fine))
        assert one == pytest.approx(other, abs=1e-9)


def test_modes_are_grouped_by_how_far_they_wander(beta1: Sweep) -> None:
    """The paper sorts modes by their sensitivity."""
    by_kind = dict(
        zip((beta1.start.kinds[place] for place in beta1.places), beta1.groups, strict=True)
    )
    assert by_kind["inter-area"] == "A"
    assert by_kind["frequency regulation"] == "C"
    table = beta1.table()
    assert set(table["group"]) <= {"A", "B", "C"}
    assert len(table) == len(beta1.tracks) * len(NONE_TO_ONE)


def test_inertia_and_load_composition_can_be_swept() -> None:
    """Heavier machines swing more slowly; constant power takes damping away."""
    heavier = sweep(STUDY, "inertia", [1.0, 1.3]).track_of("inter-area")
    assert heavier.frequency_hz[1] < heavier.frequency_hz[0]
    stiffer = sweep(STUDY, "p_constant_power", [0.0, 0.5]).track_of("inter-area")
    assert stiffer.damping_ratio[1] < stiffer.damping_ratio[0]


def test_a_retuned_system_is_the_one_that_would_be_built() -> None:
    """Otherwise a fast sweep would answer for another system."""
    quick = linearise(retuned(STUDY.system(), "pss", {"K": 10.0, "beta1": 1.0, "beta2": 0.3}))
    slow = linearise(Study("two_area", gain=10, beta1=1.0, beta2=0.3, average="rotor").system())
    assert np.array_equal(quick.A, slow.A)


def test_single_units_can_be_retuned() -> None:
    """A root locus of one unit's gain asks which unit matters."""
    some = sweep(STUDY, "gain", [25.0, 0.0], units=["G3"]).track_of("inter-area")
    every = sweep(STUDY, "gain", [25.0, 0.0]).track_of("inter-area")
    assert every.damping_ratio[1] < some.damping_ratio[1] < some.damping_ratio[0]


@pytest.mark.parametrize(
    ("parameter", "values", "units", "words"),
    [
        ("beta3", [0, 1], None, "no sweep over 'beta3'; did you mean 'beta"),
        ("beta1", [0, 1, 0.5], None, "ascending or descending"),
        ("beta1", [0], None, "at least two values"),
        ("beta1", [0, 2], None, "'beta1' must be >= 0 and <= 1"),
        ("beta1", [0, 1], ["G7"], "unit 'G7' has no pss"),
        ("p_constant_power", [0, 1], ["G1"], "takes no units"),
    ],
)
def test_sweeps_that_cannot_be_are_refused(parameter, values, units, words) -> None:
    """A sweep over nothing would draw a picture of nothing."""
    with pytest.raises(InputError, match=words):
        sweep(STUDY, parameter, values, units)
