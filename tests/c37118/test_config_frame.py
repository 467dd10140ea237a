"""Configuration, command and header frames: there and back, and what is refused."""

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.c37118 import (
    AnalogChannel,
    Command,
    CommandFrame,
    ConfigFrame,
    DigitalWord,
    FormatBit,
    HeaderFrame,
    PhasorChannel,
    PmuConfig,
    Prefix,
)
from tieline.c37118.crc import crc_of
from tieline.errors import FrameError

PREFIX = Prefix(7, 1_700_000_000, 250_000)
NAMES = st.text(string.ascii_letters + string.digits + "_", max_size=16)
PMUS = st.builds(
    PmuConfig,
    NAMES,
    st.integers(1, 65534),
    st.integers(0, 15).map(FormatBit),
    st.lists(
        st.builds(PhasorChannel, NAMES, st.booleans(), st.integers(0, 2**24 - 1)), max_size=3
    ).map(tuple),
    st.lists(
        st.builds(AnalogChannel, NAMES, st.integers(0, 255), st.integers(-(2**23), 2**23 - 1)),
        max_size=3,
    ).map(tuple),
    st.lists(
        st.builds(
            DigitalWord,
            st.lists(NAMES, min_size=16, max_size=16).map(tuple),
            st.integers(0, 0xFFFF),
            st.integers(0, 0xFFFF),
        ),
        max_size=2,
    ).map(tuple),
    st.sampled_from([50, 60]),
    st.integers(0, 0xFFFF),
)


@given(st.lists(PMUS, max_size=3), st.integers(-32768, 32767), st.integers(1, 2**24 - 1))
def test_a_configuration_comes_back_as_it_was(
    pmus: list[PmuConfig], data_rate: int, time_base: int
) -> None:
    """Otherwise a receiver scales or names the channels of another PMU."""
    frame = ConfigFrame(PREFIX, tuple(pmus), data_rate, time_base)
    assert ConfigFrame.from_bytes(frame.to_bytes()) == frame


@pytest.mark.parametrize(
    ("pmu", "message"),
    [
        (PmuConfig("s" * 17, 7, FormatBit(0)), "at most 16 ASCII characters"),
        (PmuConfig("Zürich", 7, FormatBit(0)), "at most 16 ASCII characters"),
        (PmuConfig("s", 7, FormatBit(0), f0_hz=55), "is 50 or 60"),
        (PmuConfig("s", 1 << 16, FormatBit(0)), "IDCODE, FORMAT and counts"),
        (PmuConfig("s", 7, FormatBit(0), (PhasorChannel("V", False, 1 << 24),)), "'V' has 24 bits"),
        (PmuConfig("s", 7, FormatBit(0), (), (AnalogChannel("A", 0, 1 << 23),)), "'A' has 24 bits"),
        (PmuConfig("s", 7, FormatBit(0), (), (AnalogChannel("A", 256),)), "ANUNIT"),
        (PmuConfig("s", 7, FormatBit(0), (), (), (DigitalWord(("D",)),)), r"16 names \(got 1\)"),
    ],
)
def test_a_configuration_that_does_not_fit_is_refused(pmu: PmuConfig, message: str) -> None:
    """Otherwise the receiver gets another configuration than the one given."""
    with pytest.raises(FrameError, match=message):
        ConfigFrame(PREFIX, (pmu,), 60).to_bytes()


def test_a_time_base_of_zero_is_refused() -> None:
    """Otherwise no time tag of the stream has a meaning."""
    with pytest.raises(FrameError, match="TIME_BASE must be 1 to"):
        ConfigFrame(PREFIX, (), 60, 0).to_bytes()


def test_text_that_is_not_ascii_is_refused() -> None:
    """Otherwise a name is shown that nobody gave."""
    config = ConfigFrame(PREFIX, (PmuConfig("station", 7, FormatBit(0)),), 60).to_bytes()
    header = HeaderFrame(PREFIX, "text").to_bytes()
    for kind, data, at in ((ConfigFrame, config, 20), (HeaderFrame, header, 14)):
        broken = data[:at] + b"\xff" + data[at + 1 : -2]
        with pytest.raises(FrameError, match="ASCII"):
            kind.from_bytes(broken + crc_of(broken).to_bytes(2, "big"))


def test_a_frame_of_another_type_is_refused() -> None:
    """Otherwise a command is read as a configuration."""
    with pytest.raises(FrameError, match="SYNC of a CONFIG_2 frame must be 0xAA31 or 0xAA32"):
        ConfigFrame.from_bytes(CommandFrame(PREFIX, Command.SEND_CONFIG_2).to_bytes())


@given(st.integers(0, 0xFFFF).filter(lambda c: c != Command.EXTENDED))
def test_a_command_comes_back_as_it_was(command: int) -> None:
    """Otherwise a PMU does something else than it was told."""
    frame = CommandFrame(PREFIX, command)
    assert CommandFrame.from_bytes(frame.to_bytes()) == frame


@given(st.binary(max_size=200))
def test_only_the_extended_command_carries_more(extended: bytes) -> None:
    """Otherwise bytes that a PMU does not expect follow the command."""
    frame = CommandFrame(PREFIX, Command.EXTENDED, extended)
    assert CommandFrame.from_bytes(frame.to_bytes()) == frame
    with pytest.raises(FrameError, match="command 2 takes no extended frame"):
        CommandFrame(PREFIX, Command.TURN_ON, b"x" + extended).to_bytes()


@given(st.text(string.printable, max_size=300))
def test_a_header_comes_back_as_it_was(text: str) -> None:
    """Otherwise people read something else about the PMU than its owner wrote."""
    frame = HeaderFrame(PREFIX, text)
    assert HeaderFrame.from_bytes(frame.to_bytes()) == frame


def test_a_header_must_be_ascii_and_fit_a_frame() -> None:
    """Otherwise other receivers cannot show it."""
    with pytest.raises(FrameError, match="must be ASCII"):
        HeaderFrame(PREFIX, "50 Ω").to_bytes()
    with pytest.raises(FrameError, match="FRAMESIZE must be 0 to 65535"):
        HeaderFrame(PREFIX, "x" * 65_520).to_bytes()
