"""Bundles become messages and come back whole, or not at all."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.cosim.wire import (
    TOGETHER_BYTES,
    Kind,
    Ledger,
    join,
    put_together,
    read_parts,
    split,
)
from tieline.errors import CosimError


@given(st.binary(max_size=12_000), st.sampled_from([None, 100, 3_800]), st.randoms())
def test_a_bundle_comes_back_whatever_the_order_of_its_parts(
    payload: bytes, limit_bytes: int | None, shuffler: random.Random
) -> None:
    """If not, large bundles over tcp would be scrambled or lost."""
    messages = split(Kind.BUNDLE, 7, payload, limit_bytes)
    shuffler.shuffle(messages)
    assert all(limit_bytes is None or len(message) <= limit_bytes for message in messages)
    parts = [part for message in messages for part in read_parts(message)]
    assert {(part.kind, part.k) for part in parts} == {(Kind.BUNDLE, 7)}
    assert join(parts) == payload


def test_a_long_stride_travels_in_parts_on_a_core_without_a_limit_of_its_own() -> None:
    """If not, a large system's strides would be longer messages than HELICS was seen to carry."""
    payload = bytes(range(250)) * 5_000
    messages = put_together(split(Kind.BUNDLE, 3, payload, None), None)
    assert [len(message) <= TOGETHER_BYTES for message in messages] == [True] * 3
    assert join(part for message in messages for part in read_parts(message)) == payload


@given(
    st.lists(st.binary(max_size=3_000), min_size=1, max_size=9),
    st.sampled_from([None, 100, 3_800]),
)
def test_bundles_of_one_meeting_travel_together_in_their_order(
    payloads: list[bytes], limit_bytes: int | None
) -> None:
    """If not, a meeting would cost a message for each interval, or tcp would lose a long one."""
    alone = [m for k, body in enumerate(payloads) for m in split(Kind.BUNDLE, k, body, limit_bytes)]
    messages = put_together(alone, limit_bytes)
    assert b"".join(messages) == b"".join(alone)
    if limit_bytes is None:
        assert len(messages) == 1
    else:
        assert all(len(message) <= limit_bytes for message in messages)
    parts = [part for message in messages for part in read_parts(message)]
    for k, body in enumerate(payloads):
        assert join(part for part in parts if part.k == k) == body


def test_a_message_cut_anywhere_is_refused() -> None:
    """If not, a bundle would lose its last deliveries silently."""
    message = b"".join(split(Kind.BUNDLE, 0, b"frames", None) + split(Kind.BUNDLE, 1, b"", None))
    whole = [len(split(Kind.BUNDLE, 0, b"frames", None)[0]), len(message)]
    for end in set(range(len(message))) - set(whole):
        with pytest.raises(CosimError, match="a message of"):
            read_parts(message[:end])


@pytest.mark.parametrize("spoil", [lambda p: p[1:], lambda p: p[:-1], lambda p: [p[0], *p]])
def test_a_bundle_with_a_missing_or_doubled_part_is_refused(spoil) -> None:
    """If not, a message that HELICS lost would shorten a bundle silently."""
    (message,) = put_together(split(Kind.BUNDLE, 0, bytes(10_000), 3_800), None)
    parts = read_parts(message)
    with pytest.raises(CosimError, match="a bundle of 3 parts came as parts"):
        join(spoil(parts))


@pytest.mark.parametrize(
    "data",
    [b"", b"TLM", b"hello, this is not a message", b"TLM1" + bytes(13), b"TLM2" + b"\xff" * 13],
)
def test_bytes_of_somebody_else_are_refused(data: bytes) -> None:
    """If not, a foreign federate's message would be taken for a bundle."""
    with pytest.raises(CosimError, match="a message of"):
        read_parts(data)


def test_two_ledgers_of_one_stream_agree() -> None:
    """If not, no federation could end."""
    sent, received = Ledger(), Ledger()
    for payload in (b"", b"abc", bytes(5_000)):
        sent.add(payload)
        received.add(payload)
    received.check(sent.to_bytes(), "grid")


@pytest.mark.parametrize(
    "stream", [[b"abc"], [b"abc", b"de", b""], [b"abcd", b"e"], [b"abc", b"dE"], []]
)
def test_any_difference_between_two_streams_shows_in_their_ledgers(stream: list[bytes]) -> None:
    """If not, a lost, changed or re-cut message would pass unseen."""
    sent, received = Ledger(), Ledger()
    for payload in (b"abc", b"de"):
        sent.add(payload)
    for payload in stream:
        received.add(payload)
    with pytest.raises(CosimError, match="grid sent 2 messages, 5 bytes"):
        received.check(sent.to_bytes(), "grid")


def test_an_end_marker_of_the_wrong_length_is_refused() -> None:
    """If not, the comparison would fail with a struct error that names nobody."""
    with pytest.raises(CosimError, match="the end marker of grid has 3 bytes"):
        Ledger().check(b"abc", "grid")
