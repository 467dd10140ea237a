"""Modes: vectors, participation, residues, and the rule that names them."""

import numpy as np
import pytest

from tieline.errors import InputError
from tieline.linear import Modes, Study, linearise, modes, response
from tieline.linear.modes import modes_of

FREQUENCY_REGULATION, INTER_AREA, LOCAL = "frequency regulation", "inter-area", "local"


@pytest.fixture(scope="module")
def plain() -> Modes:
    """The two-area system without stabilisers."""
    return modes("two_area", pss="none")


@pytest.fixture(scope="module")
def damped() -> Modes:
    return modes("two_area", gain=25, beta1=0.5, beta2=0.5, average="rotor")


@pytest.fixture(scope="module")
def miniwecc() -> Modes:
    return modes("miniwecc", pss="none")


def test_the_two_area_system_has_the_papers_modes(plain: Modes) -> None:
    """0.76 Hz and unstable between the areas, 0.09 Hz for all of them together, two local ones."""
    kinds = {kind: plain.of_kind(kind) for kind in (FREQUENCY_REGULATION, INTER_AREA, LOCAL)}
    assert [len(found) for found in kinds.values()] == [1, 1, 2]
    slow, between = kinds[FREQUENCY_REGULATION][0], kinds[INTER_AREA][0]
    assert plain.frequency_hz[between] == pytest.approx(0.76, abs=0.001)
    assert plain.damping_ratio[between] < 0
    assert plain.frequency_hz[slow] == pytest.approx(0.09, abs=0.001)


def test_in_the_frequency_regulation_mode_all_speeds_are_nearly_equal(plain: Modes) -> None:
    """That is what makes it the mode of the average."""
    shape = plain.shapes[:, plain.of_kind(FREQUENCY_REGULATION)[0]]
    assert np.abs(shape).min() > 0.95
    assert np.abs(np.angle(shape, deg=True)).max() < 5


def test_g1_and_g2_swing_against_g3_and_g4(plain: Modes) -> None:
    """The inter-area shape of the paper."""
    shape = plain.shapes[:, plain.of_kind(INTER_AREA)[0]]
    G1, G2, G3, G4 = np.angle(shape, deg=True)
    for one in (G1, G2):
        for other in (G3, G4):
            assert abs((one - other) % 360 - 180) < 25
    assert max(abs(G1 - G2), abs(G3 - G4)) < 15


def test_the_miniwecc_has_its_known_inter_area_modes(miniwecc: Modes) -> None:
    """North-south A and B, east-west and British Columbia; all units together at 0.044 Hz."""
    slow = miniwecc.of_kind(FREQUENCY_REGULATION)
    assert miniwecc.frequency_hz[slow] == pytest.approx([0.0437], abs=5e-4)
    between = miniwecc.frequency_hz[miniwecc.of_kind(INTER_AREA)]
    assert between[:4] == pytest.approx([0.218, 0.373, 0.510, 0.624], abs=1e-3)
    # A mode of G12 alone, whose speed is in phase with nothing else that is seen, is local.
    alone = int(np.argmin(np.abs(miniwecc.frequency_hz - 1.331)))
    assert miniwecc.kinds[alone] == LOCAL


def test_vectors_belong_to_their_eigenvalues_and_are_scaled(damped: Modes) -> None:
    """Participations and residues rest on it."""
    A = damped.linear.A
    for k in damped.of_kind(FREQUENCY_REGULATION, INTER_AREA, LOCAL):
        right, left = damped.right[:, k], damped.left[:, k]
        value = damped.eigenvalues[k]
        assert np.abs(A @ right - value * right).max() < 1e-9
        assert np.abs(left.conj() @ A - value * left.conj()).max() < 1e-6 * np.abs(left).max()
        assert left.conj() @ right == pytest.approx(1.0, abs=1e-9)
        assert damped.participation[:, k].sum() == pytest.approx(1.0)


def test_residues_rebuild_the_response(damped: Modes) -> None:
    """A transfer function is the sum of its residues over its poles."""
    linear = damped.linear
    output, input_ = "speed.G1", "Vref.G3"
    at = 2j * np.pi * 0.5
    expected = response(linear, input_, output).at(at)
    residues = damped.residues(output, input_)
    moving = np.isfinite(residues)
    total = np.sum(residues[moving] / (at - damped.eigenvalues[moving]))
    pairs = moving & (damped.eigenvalues.imag > 0)
    total += np.sum(residues[pairs].conj() / (at - damped.eigenvalues[pairs].conj()))
    # The many equal eigenvalues of bus filters cost digits; they do not show in a speed.
    assert total == pytest.approx(expected, rel=1e-4)


def test_the_gain_moves_what_the_paper_says(plain: Modes, damped: Modes) -> None:
    """A standard stabiliser damps both the inter-area and the frequency-regulation mode."""
    for kind in (FREQUENCY_REGULATION, INTER_AREA):
        before, after = plain.of_kind(kind)[0], damped.of_kind(kind)[0]
        assert damped.damping_ratio[after] > plain.damping_ratio[before] + 0.1


def test_the_table_names_states_and_units(plain: Modes) -> None:
    """A reader must see at once who swings."""
    table = plain.table()
    row = table[table["kind"] == INTER_AREA].iloc[0]
    assert row["frequency_Hz"] == pytest.approx(0.76, abs=1e-3)
    assert "omega.G" in row["states"]
    assert row["shape"].startswith(("G3 1.00", "G4 1.00"))
    shape = plain.shape_table(int(plain.of_kind(INTER_AREA)[0]))
    assert shape["size"].max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"average": "sensors"}, "average must be one of sensor, rotor"),
        ({"pss": "standart"}, "did you mean 'standard'"),
        ({"beta1": 2}, "beta1 must be 1 or less"),
        ({"units": ["G9"]}, "G9"),
        ({"weights": [1.0]}, "one weight"),
        ({"inertia": 0.0}, "inertia must be > 0"),
    ],
)
def test_settings_that_cannot_be_are_refused(settings: dict, words: str) -> None:
    """Otherwise a mistyped study would answer another question."""
    with pytest.raises(InputError, match=words):
        modes_of(linearise(Study("two_area", **settings).system()))
