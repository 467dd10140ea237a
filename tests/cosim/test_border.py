"""The grid's border: a bundle of deliveries is whole, in order, once and in time, or refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.cosim.border import FRAMES_REMEMBERED, DeliveryBorder, check_stamps
from tieline.cosim.interfaces import DELIVERY, Clock, DeliveryBundle, FrameBundle
from tieline.errors import CosimError, TimeContractBroken
from tieline.units import tick_ns

RATE_HZ, SOURCES, DESTINATIONS = 60, 3, 2
CLOCK = Clock(RATE_HZ, 2_000)
T1_NS, T2_NS = tick_ns(1, RATE_HZ), tick_ns(2, RATE_HZ)
PAYLOADS = np.zeros((1, 34), np.uint8)
Row = tuple[int, int, int, int]


def bundle(*rows: Row, until_ns: int = T2_NS) -> DeliveryBundle:
    """Return a bundle of (arrival_ns, source, destination, sequence)."""
    records = np.zeros(len(rows), DELIVERY)
    for name, values in zip(DELIVERY.names or (), zip(*rows, strict=True), strict=False):
        records[name] = values
    return DeliveryBundle(until_ns, records, PAYLOADS)


def border(before: int = 1) -> DeliveryBorder:
    """Return a border that has seen empty bundles of the intervals before one."""
    made = DeliveryBorder(CLOCK, SOURCES, DESTINATIONS)
    for k in range(before):
        made.check(k, bundle(until_ns=CLOCK.at_ns(k + 1)))
    return made


def ordered(rows: list[Row]) -> list[Row]:
    """Return rows in the order (arrival, source, sequence, destination)."""
    return sorted(rows, key=lambda row: (row[0], row[1], row[3], row[2]))


deliveries = st.lists(
    st.tuples(
        st.integers(T1_NS, T1_NS + 5) | st.integers(T1_NS, T2_NS),
        st.integers(0, SOURCES - 1),
        st.integers(0, DESTINATIONS - 1),
        st.integers(0, 1),
    ),
    unique_by=lambda row: row[1:],
    min_size=1,
).map(ordered)


@given(deliveries)
def test_what_the_contract_allows_passes(rows: list[Row]) -> None:
    """A border that stops sound deliveries would end every run."""
    border().check(1, bundle(*rows))


@given(deliveries, st.data())
def test_deliveries_in_another_order_break_the_contract(
    rows: list[Row], data: st.DataObject
) -> None:
    """The newest frame wins; in another order, another one might be the last."""
    other = data.draw(st.permutations(rows))
    if other == rows:
        return
    with pytest.raises(TimeContractBroken, match=r"interval 1: delivery .* out of order"):
        border().check(1, bundle(*other))


@given(deliveries, st.data())
def test_one_spoilt_delivery_among_sound_ones_is_found(
    rows: list[Row], data: st.DataObject
) -> None:
    """One delivery from outside its interval, or from before its measurement, must not slip by."""
    at = data.draw(st.integers(0, len(rows) - 1))
    arrival_ns, source, destination, sequence = rows[at]
    spoilt, words = data.draw(
        st.sampled_from(
            [
                ((T1_NS - 1, source, destination, sequence), "for the interval from"),
                ((T2_NS + 1, source, destination, sequence), "for the interval from"),
                ((-1, source, destination, sequence), "for the interval from"),
                ((arrival_ns, source, destination, 3), "was measured only at"),
            ]
        )
    )
    with pytest.raises(TimeContractBroken, match=f"delivery {at} of {len(rows)}.*{words}"):
        border().check(1, bundle(*rows[:at], spoilt, *rows[at + 1 :]))


@given(deliveries, st.data())
def test_a_packet_delivered_twice_breaks_the_contract(rows: list[Row], data: st.DataObject) -> None:
    """A network that doubles packets would be taken for one that delivers more than it got."""
    again = data.draw(st.sampled_from(rows))
    later_ns = data.draw(st.integers(again[0], T2_NS))
    with pytest.raises(TimeContractBroken, match="has been delivered before"):
        border().check(1, bundle(*ordered([*rows, (later_ns, *again[1:])])))


def test_a_packet_delivered_again_in_a_later_interval_breaks_the_contract() -> None:
    """The copy may come much later, by another way through the network."""
    checked = border()
    checked.check(1, bundle((T1_NS, 2, 1, 1)))
    for k in range(2, 700):
        checked.check(k, bundle(until_ns=CLOCK.at_ns(k + 1)))
    with pytest.raises(TimeContractBroken, match=r"frame 1 of PMU 2 .* been delivered before"):
        checked.check(700, bundle((CLOCK.at_ns(700), 2, 1, 1), until_ns=CLOCK.at_ns(701)))


def test_the_frame_that_takes_a_forgotten_ones_place_is_not_taken_for_it() -> None:
    """Memory is bounded; what is forgotten must not turn into an accusation."""
    checked = border()
    checked.check(1, bundle((T1_NS, 2, 1, 1)))
    last = FRAMES_REMEMBERED + 1
    for k in range(2, last):
        checked.check(k, bundle(until_ns=CLOCK.at_ns(k + 1)))
    at_ns = CLOCK.at_ns(last)
    both = bundle((at_ns, 2, 1, 1), (at_ns, 2, 1, last), until_ns=CLOCK.at_ns(last + 1))
    checked.check(last, both)


def test_a_frame_of_the_intervals_end_cannot_have_crossed_the_network_yet() -> None:
    """It is measured only after the network has sent its deliveries."""
    with pytest.raises(TimeContractBroken, match="after the interval's begin"):
        border().check(1, bundle((T2_NS, 0, 0, 2)))


@pytest.mark.parametrize(("source", "destination"), [(3, 0), (0, 2), (65_535, 65_535)])
def test_a_delivery_from_or_to_nobody_is_an_error(source: int, destination: int) -> None:
    """It would otherwise be read as somebody else's."""
    with pytest.raises(CosimError, match="no such PMU or controller"):
        border().check(1, bundle((T1_NS, source, destination, 1)))


@pytest.mark.parametrize("until_ns", [0, T2_NS - 1, T2_NS + 1, 2**63 - 1])
def test_a_bundle_with_another_stamp_breaks_the_contract(until_ns: int) -> None:
    """Empty or not, it tells of another interval than the one that is simulated next."""
    with pytest.raises(TimeContractBroken, match=f"stamped {until_ns} ns, which must be {T2_NS}"):
        border().check(1, bundle(until_ns=until_ns))


@pytest.mark.parametrize("k", [0, 2])
def test_an_interval_left_out_or_repeated_breaks_the_contract(k: int) -> None:
    """Deliveries would be applied twice, or never."""
    with pytest.raises(TimeContractBroken, match=f"interval {k} came for interval 1"):
        border().check(k, bundle(until_ns=CLOCK.at_ns(k + 1)))


def test_packets_for_guests_cannot_be_stamped_outside_their_interval() -> None:
    """HELICS hands over at once what is stamped in the past, as if it were new."""
    check_stamps("network", CLOCK, 1, np.array([], np.int64))
    check_stamps("network", CLOCK, 1, np.array([T1_NS, T2_NS]))
    for arrivals in ([T1_NS - 1, T2_NS], [T1_NS, T2_NS + 1]):
        with pytest.raises(TimeContractBroken, match=r"outside interval 1 from 0\.016666666"):
            check_stamps("network", CLOCK, 1, np.array(arrivals))


STRIDES = Clock(RATE_HZ, 2_000, lead=5)
T3_NS, T6_NS = tick_ns(3, RATE_HZ), tick_ns(6, RATE_HZ)


def strides() -> DeliveryBorder:
    """Return a border whose federates meet every three intervals, after the first stride."""
    made = DeliveryBorder(STRIDES, SOURCES, DESTINATIONS)
    made.check(0, bundle((T2_NS, 1, 0, 0), until_ns=T3_NS))
    return made


def test_with_a_lead_a_bundle_holds_a_whole_stride() -> None:
    """Otherwise grid and network would have to meet at every interval."""
    strides().check(3, bundle((T3_NS + 1, 0, 0, 0), (T6_NS, 2, 1, 2), until_ns=T6_NS))


@pytest.mark.parametrize(
    ("row", "what"),
    [
        ((T3_NS + 9, 1, 0, 0), "has been delivered before"),
        ((T6_NS, 0, 0, 4), "is measured .* after the interval's begin"),
        ((T6_NS + 1, 0, 0, 2), "came for the interval from 50000000 to 100000000 ns"),
    ],
)
def test_with_a_lead_a_delivery_outside_the_contract_is_refused(row: Row, what: str) -> None:
    """A packet that comes twice, or too early, must not slip by because strides are longer."""
    with pytest.raises(TimeContractBroken, match=what):
        strides().check(3, bundle(row, until_ns=T6_NS))
    with pytest.raises(TimeContractBroken, match="came for interval 3"):
        strides().check(4, bundle(until_ns=T6_NS))


def test_frames_of_several_instants_are_one_message() -> None:
    """Otherwise the network would take the frames of one instant for those of another."""
    bundles = [FrameBundle(t, np.full((2, 34), t % 251, np.uint8)) for t in (0, T1_NS, T2_NS)]
    message = b"".join(each.to_bytes() for each in bundles)
    found = FrameBundle.several_from_bytes(message)
    assert [each.measured_ns for each in found] == [0, T1_NS, T2_NS]
    assert [each.to_bytes() for each in found] == [each.to_bytes() for each in bundles]
    for cut in (message[:-1], message + b"TLF1", b""):
        with pytest.raises(CosimError):
            FrameBundle.several_from_bytes(cut)
    with pytest.raises(CosimError, match="one instant, got 3"):
        FrameBundle.from_bytes(message)
