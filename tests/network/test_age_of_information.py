"""Age of information, against integrals done by hand and by brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.network.age import NEVER, AgeOfInformation


def age_of(arrivals: list[tuple[int, int]]) -> AgeOfInformation:
    """Return the age of one flow after arrivals (arrival, measured), one call each."""
    age = AgeOfInformation(1)
    for arrival_ns, measured_ns in arrivals:
        age.add(np.array([0]), np.array([arrival_ns]), np.array([measured_ns]))
    return age


def test_age_computed_by_hand():
    """Otherwise the age that a controller acts on would be reported wrongly.

    Frames of 0, 10 and 20 arrive at 4, 13 and 28, and the run ends at 30. The age is 4 at first and
    grows to 13; falls to 3, grows to 18; falls to 8, grows to 10. Three trapezoids:
    (4 + 13) / 2 * 9 + (3 + 18) / 2 * 15 + (8 + 10) / 2 * 2 = 76.5 + 157.5 + 18 = 252, over 26.
    """
    age = age_of([(4, 0), (13, 10), (28, 20)])
    assert age.mean_ns(30)[0] == pytest.approx(252 / 26, rel=1e-15)
    assert age.peak_mean_ns()[0] == (13 + 18) / 2
    assert age.max_ns(30)[0] == 18
    assert age.max_ns(50)[0] == 30


def test_a_frame_that_was_overtaken_does_not_make_the_data_older():
    """Otherwise reordering would seem to take fresh data away from a controller."""
    fresh = age_of([(4, 0), (13, 10)])
    with_late = age_of([(4, 0), (13, 10), (14, 5)])
    for figure in ("mean_ns", "max_ns"):
        assert getattr(fresh, figure)(20) == getattr(with_late, figure)(20)
    assert with_late.measured_ns.tolist() == [10]


def test_equal_gaps_and_delays_have_the_textbook_mean():
    """Otherwise the figure could not be compared with published ones.

    With a constant gap T and delay D the age runs from D to D + T: mean D + T / 2, peak D + T.
    """
    gap_ns, delay_ns = 16_666_667, 100_000_000
    age = age_of([(k * gap_ns + delay_ns, k * gap_ns) for k in range(2_000)])
    end_ns = 2_000 * gap_ns + delay_ns
    assert age.mean_ns(end_ns)[0] == pytest.approx(delay_ns + gap_ns / 2, rel=1e-9)
    assert age.peak_mean_ns()[0] == delay_ns + gap_ns


def test_nothing_held_has_no_age():
    """Otherwise a controller without data would seem to have fresh data."""
    age = AgeOfInformation(1)
    assert age.measured_ns.tolist() == [NEVER]
    assert np.isnan([age.mean_ns(10)[0], age.peak_mean_ns()[0], age.max_ns(10)[0]]).all()
    assert np.isnan(age_of([(4, 0)]).peak_mean_ns()[0])


def test_a_frame_that_arrives_at_the_end_has_an_age():
    """Otherwise a short run would divide by no time."""
    assert age_of([(30, 12)]).mean_ns(30)[0] == 18


# The first example compiles, so no deadline holds.
@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 400), st.integers(0, 100)), min_size=1, max_size=30))
def test_the_mean_is_the_integral_of_the_age(frames):
    """Otherwise 'exactly integrated' would be a claim.

    The age is summed at the middle of each unit of time, which is exact for straight pieces whose
    corners are whole.
    """
    arrivals = sorted((measured + delay, measured) for measured, delay in frames)
    end = arrivals[-1][0] + 7
    middles = np.arange(arrivals[0][0], end) + 0.5
    freshest = [max(m for a, m in arrivals if a <= middle) for middle in middles]
    assert age_of(arrivals).mean_ns(end)[0] == pytest.approx(np.mean(middles - freshest), rel=1e-12)
