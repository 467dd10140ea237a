"""What a controller believes: weights, rest, ages, and which frames it takes."""

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.c37118.batch import encode_frames
from tieline.errors import CosimError, InputError
from tieline.units import tick_ns
from tieline.wams import Fate, PmuReporter, WideAreaAverage, checked_weights

EPOCH_S = 1_700_000_000
F0_HZ = 60.0


def frames(idcodes: list[int], k: int, f_hz: list[float], stat: int | list[int] = 0) -> np.ndarray:
    """Return the frames of interval k with phasors of 1 V, read-only as if off a message."""
    phasors = np.ones(len(idcodes), complex)
    rows = encode_frames(
        idcodes, tick_ns(k, 60), phasors, f_hz, np.zeros(len(idcodes)), epoch_s=EPOCH_S, stat=stat
    )
    return np.frombuffer(rows.tobytes(), np.uint8).reshape(rows.shape)


def average_of(idcodes: list[int], weights: list[float] | None = None) -> WideAreaAverage:
    """Return two controllers that listen to `idcodes`."""
    return WideAreaAverage(2, idcodes, weights, F0_HZ, EPOCH_S)


def give(average: WideAreaAverage, payloads: np.ndarray, controller: int = 0) -> None:
    """Deliver every payload to one controller, in their order."""
    rows = np.arange(len(payloads))
    average.deliver(payloads, np.full(len(rows), controller), rows)


def counts_of(average: WideAreaAverage, controller: int = 0) -> dict[str, int]:
    """Return what a controller counted, without the zeros."""
    return {
        name: int(values[controller])
        for name, values in average.counts.items()
        if values[controller]
    }


def test_the_average_is_taken_of_the_newest_frames() -> None:
    """Otherwise the controllers do not know the frequency of the system."""
    average = average_of([1, 2, 3])
    give(average, frames([1, 2, 3], 0, [60.5, 59.25, 60.0]))
    give(average, frames([2], 1, [59.75]))
    # binary fractions, so that the sum is exact and only the division rounds
    assert average.wbar_pu[0] == pytest.approx((60.5 + 59.75 + 60.0) / 3 / 60, rel=1e-15)
    assert average.wbar_pu[1] == 1.0
    assert average.held_f_hz.tolist() == [[60.5, 59.75, 60.0], [60.0, 60.0, 60.0]]
    assert counts_of(average) == {"accepted": 4}


def test_given_weights_are_scaled_to_sum_one() -> None:
    """Otherwise weights given as megawatts make a controller believe in kilohertz."""
    average = average_of([4, 9], [30.0, 10.0])
    give(average, frames([4, 9], 0, [61.0, 57.0]))
    assert average.wbar_pu[0] == pytest.approx((0.75 * 61.0 + 0.25 * 57.0) / 60, rel=1e-15)
    assert checked_weights(None, 4).tolist() == [0.25] * 4


@given(
    st.lists(
        st.floats(0, 1e6).filter(lambda x: x == 0 or x > 1e-6), min_size=1, max_size=40
    ).filter(any),
    st.sampled_from([50.0, 60.0]),
)
def test_a_system_at_rest_stays_at_rest_to_the_last_bit(weights: list[float], f0_hz: float) -> None:
    """Otherwise the rounding of the weights drives every stabiliser from the first step on."""
    n = len(weights)
    average = WideAreaAverage(1, list(range(1, n + 1)), weights, f0_hz, EPOCH_S)
    assert average.wbar_pu.tolist() == [1.0]
    give(average, frames(list(range(1, n + 1)), 0, [f0_hz] * n))
    assert average.wbar_pu.tolist() == [1.0]


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([1.0, 2.0], r"3 sensors need as many weights \(got 2\)"),
        ([1.0, -2.0, 1.0], r"wams.weights\[1\] must be finite and at least 0 \(got -2.0\)"),
        ([1.0, 2.0, np.nan], r"wams.weights\[2\]"),
        ([0.0, 0.0, 0.0], "must not all be 0"),
    ],
)
def test_weights_that_make_no_average_are_refused(weights: list[float], message: str) -> None:
    """Otherwise wbar is no average, and no message says why the run went wrong."""
    with pytest.raises(InputError, match=message):
        average_of([1, 2, 3], weights)


def test_every_wrong_weight_is_reported() -> None:
    """Otherwise the user mends one weight a run."""
    with pytest.raises(InputError) as refusal:
        checked_weights([-1.0, 1.0, np.inf], 3)
    assert len(refusal.value.findings) == 2


@pytest.mark.parametrize("idcodes", [[], [1, 2, 1], [0, 1], [65535]])
def test_sensors_need_distinct_stream_numbers_of_the_standard(idcodes: list[int]) -> None:
    """Otherwise two PMUs overwrite each other's frequency."""
    with pytest.raises(InputError, match="distinct numbers from 1 to 65534"):
        average_of(idcodes)
    with pytest.raises(InputError, match="distinct numbers from 1 to 65534"):
        PmuReporter(idcodes, np.ones(len(idcodes)))


def test_a_late_frame_never_overwrites_a_newer_one() -> None:
    """Otherwise jitter throws the controllers back in time."""
    average = average_of([1])
    for k, f_hz in ((0, 60.0), (2, 59.5), (1, 70.0)):
        give(average, frames([1], k, [f_hz]))
    assert average.held_f_hz[0, 0] == 59.5
    assert counts_of(average) == {"accepted": 2, "late": 1}


def test_a_duplicate_changes_nothing_but_its_count() -> None:
    """Otherwise a network that repeats packets changes the result."""
    average = average_of([1])
    for f_hz in (59.5, 59.5, 70.0):
        give(average, frames([1], 0, [f_hz]))
    assert average.held_f_hz[0, 0] == 59.5
    assert counts_of(average) == {"accepted": 1, "duplicate": 2}


def test_a_sensor_whose_first_frames_are_lost_counts_as_nominal() -> None:
    """Otherwise one slow PMU keeps a controller from starting, or starts it from zero."""
    average = average_of([1, 2])
    give(average, frames([2], 5, [63.0]))
    assert average.held_f_hz[0].tolist() == [60.0, 63.0]
    assert average.wbar_pu[0] == pytest.approx(61.5 / 60, rel=1e-15)


def test_frames_that_must_not_be_used_are_refused_and_counted() -> None:
    """Otherwise one broken PMU or line moves every stabiliser, and nobody can see which."""
    average = average_of([1, 2])
    sound = frames([1, 2], 3, [61.0, 62.0])
    give(average, sound)
    broken = frames([1, 1, 1, 2, 7, 1], 4, [70.0] * 4 + [70.0, np.nan], [0, 0, 0, 0x8000, 0, 0])
    broken = broken.copy()
    broken[0, 20] ^= 1
    broken[1, 0] = 0xAB
    broken[2, 3] = 33
    give(average, broken)
    give(average, np.zeros((1, 40), np.uint8))
    assert average.held_f_hz[0].tolist() == [61.0, 62.0]
    assert counts_of(average) == {
        "accepted": 2,
        "bad_crc": 1,
        "bad_sync": 1,
        "bad_size": 2,
        "data_error": 1,
        "unknown_idcode": 1,
        "no_frequency": 1,
    }
    assert counts_of(average, 1) == {}


def test_one_payload_reaches_many_controllers() -> None:
    """Otherwise each copy of a frame has to cross the federation by itself."""
    average = average_of([1, 2])
    payloads = frames([1, 2], 0, [61.0, 62.0])
    average.deliver(payloads, np.array([1, 0, 1], np.uint16), np.array([0, 1, 1], np.uint32))
    assert average.held_f_hz.tolist() == [[60.0, 62.0], [61.0, 62.0]]


def test_frames_read_once_can_be_applied_in_parts() -> None:
    """Otherwise a bundle whose packets arrive between integration steps is decoded at each step."""
    whole, parts = average_of([1, 2]), average_of([1, 2])
    payloads = frames([1, 2, 2], 0, [61.0, 62.0, 62.0])
    controllers, rows = np.array([0, 1, 1, 0]), np.array([0, 1, 2, 1])
    whole.deliver(payloads, controllers, rows)
    readings = parts.read(payloads)
    assert parts.wbar_pu.tolist() == [1.0, 1.0]
    for start, stop in ((0, 1), (1, 1), (1, 4)):
        moments = np.zeros(stop - start, np.int64)
        parts.apply(readings, controllers[start:stop], rows[start:stop], moments)
    assert parts.held_f_hz.tolist() == whole.held_f_hz.tolist()
    assert counts_of(parts, 1) == counts_of(whole, 1) == {"accepted": 1, "duplicate": 1}


def test_what_is_believed_is_told_after_each_moment() -> None:
    """A controller that heard of a later frame early would act on it before it came."""
    average = average_of([1, 2])
    readings = average.read(frames([1, 2], 0, [61.0, 62.0]))
    controllers, rows = np.array([0, 1, 0]), np.array([0, 0, 1])
    moments, wbar = average.apply(readings, controllers, rows, np.array([3, 3, 5]))
    assert moments.tolist() == [3, 5]
    np.testing.assert_allclose(wbar * 60, [[60.5, 60.5], [61.5, 60.5]], rtol=1e-15)


def test_nothing_delivered_changes_nothing() -> None:
    """Otherwise an interval without arrivals ends the run."""
    average = average_of([1])
    average.deliver(np.empty((0, 34), np.uint8), np.empty(0, np.uint16), np.empty(0, np.uint32))
    average.deliver(np.empty((0, 0), np.uint8), np.empty(0, np.uint16), np.empty(0, np.uint32))
    assert average.wbar_pu.tolist() == [1.0, 1.0]
    assert counts_of(average) == {}


@pytest.mark.parametrize(("controller", "row"), [(2, 0), (-1, 0), (0, 1), (0, -1)])
def test_a_delivery_to_nobody_or_of_nothing_is_refused(controller: int, row: int) -> None:
    """Otherwise memory beyond the tables is read, or another controller's belief is changed."""
    average = average_of([1])
    with pytest.raises(CosimError, match="a delivery brings payload"):
        average.deliver(frames([1], 0, [60.0]), np.array([controller]), np.array([row]))


def test_ages_are_counted_from_the_time_tags() -> None:
    """Otherwise the age of information in the results is not what the controllers acted on."""
    average = average_of([1, 2])
    assert average.age_s(250_000_000).tolist() == [0.25, 0.25]
    give(average, frames([1, 2], 6, [60.0, 60.0]))
    give(average, frames([2], 12, [60.0]))
    now_ns = 400_000_000
    assert average.age_s(now_ns)[0] == pytest.approx((0.3 + 0.2) / 2, abs=1e-12)
    assert average.oldest_age_s(now_ns)[0] == pytest.approx(0.3, abs=1e-12)
    assert average.oldest_age_s(now_ns)[1] == 0.4


def test_a_frame_just_measured_is_not_younger_than_now() -> None:
    """Otherwise rounding the tag to microseconds gives a negative age (k = 1: tag 16667 us)."""
    average = average_of([1])
    give(average, frames([1], 1, [60.0]))
    assert average.age_s(tick_ns(1, 60))[0] == 0.0


DELIVERIES = st.lists(
    st.tuples(st.integers(0, 1), st.integers(0, 2), st.integers(0, 5), st.booleans()), max_size=30
)


@given(DELIVERIES, st.randoms(use_true_random=False))
def test_the_frames_held_do_not_depend_on_the_order_of_arrival(
    deliveries: list, shuffler: random.Random
) -> None:
    """Otherwise a controller's belief depends on how simultaneous packets are sorted.

    A delivery is (controller, sensor, interval, whether the line broke it); the frequency tells
    sensor and interval. What is held must be the newest sound frame of each sensor.
    """
    held = np.full((2, 3), F0_HZ)
    newest = np.full((2, 3), -1)
    for controller, sensor, k, is_broken in deliveries:
        if not is_broken and k > newest[controller, sensor]:
            newest[controller, sensor] = k
            held[controller, sensor] = 55.0 + sensor + k / 8
    for order in (deliveries, shuffler.sample(deliveries, len(deliveries))):
        average = average_of([1, 2, 3])
        payloads = [frames([1 + s], k, [55.0 + s + k / 8])[0].copy() for _, s, k, _ in order]
        for payload, (*_, is_broken) in zip(payloads, order, strict=True):
            payload[25] ^= is_broken
        table = np.array(payloads, np.uint8).reshape(-1, 34)
        controllers = np.array([controller for controller, *_ in order], np.int64)
        average.deliver(table, controllers, np.arange(len(table)))
        assert average.held_f_hz.tolist() == held.tolist()
        assert sum(values.sum() for values in average.counts.values()) == len(order)
        assert average.counts["bad_crc"].sum() == sum(is_broken for *_, is_broken in order)


def test_every_fate_has_a_count() -> None:
    """Otherwise a refused frame is lost from the account of packets."""
    assert list(average_of([1]).counts) == [fate.name.lower() for fate in Fate]
