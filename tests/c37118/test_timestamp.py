"""Time tags against nanoseconds."""

from hypothesis import given
from hypothesis import strategies as st

from tieline.c37118.timestamp import soc_fracsec, time_ns
from tieline.units import tick_ns

EPOCH_S = 1_700_000_000


@given(st.integers(0, 10**15), st.sampled_from([1_000_000, 600, 0xFFFFFF]))
def test_a_time_tag_is_the_nearest_tick(instant_ns: int, time_base: int) -> None:
    """Otherwise every age and every alignment by time tag is biased."""
    soc, fracsec = soc_fracsec(instant_ns, EPOCH_S, time_base)
    assert 0 <= fracsec < time_base
    ticks = (soc - EPOCH_S) * time_base + fracsec
    assert abs(ticks * 10**9 - instant_ns * time_base) * 2 <= 10**9
    # half a tick from the tag, and half a nanosecond from writing it as whole nanoseconds
    assert abs(time_ns(soc, fracsec, EPOCH_S, time_base) - instant_ns) <= 0.5e9 / time_base + 0.5


@given(st.integers(0, 2**31), st.integers(0, 999_999))
def test_a_tag_in_microseconds_survives_the_way_there_and_back(second: int, fracsec: int) -> None:
    """Otherwise a frame relayed twice drifts in time."""
    instant_ns = time_ns(EPOCH_S + second, fracsec, EPOCH_S)
    assert instant_ns == second * 10**9 + fracsec * 1000
    assert soc_fracsec(instant_ns, EPOCH_S) == (EPOCH_S + second, fracsec)


def test_a_fraction_that_rounds_up_to_a_second_carries() -> None:
    """Otherwise FRACSEC reaches TIME_BASE, which no receiver accepts."""
    assert soc_fracsec(999_999_600, EPOCH_S) == (EPOCH_S + 1, 0)


def test_sixty_frames_a_second_carry_sixty_distinct_tags() -> None:
    """Otherwise a controller takes the second of two frames for a duplicate."""
    tags = [soc_fracsec(tick_ns(k, 60), EPOCH_S) for k in range(121)]
    assert tags == sorted(set(tags))
    assert tags[1] == (EPOCH_S, 16667)
    assert tags[60] == (EPOCH_S + 1, 0)
