"""Data frames of every format: there and back, and what is refused."""

import cmath
import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.c37118 import (
    AnalogChannel,
    ConfigFrame,
    DataError,
    DataFrame,
    DigitalWord,
    FormatBit,
    PhasorChannel,
    PmuConfig,
    PmuData,
    Prefix,
)
from tieline.c37118.crc import crc_of
from tieline.errors import FrameError

FORMATS = st.integers(0, 15).map(FormatBit)
SCALE = 915_527
"""1e-5 V a bit: a 16-bit phasor then reaches 300 kV."""


def config_of(form: FormatBit, phasors: int, analogs: int, digitals: int) -> ConfigFrame:
    """Return a stream of one PMU with channels named by their number."""
    pmu = PmuConfig(
        "station",
        7,
        form,
        tuple(PhasorChannel(f"P{i}", False, SCALE) for i in range(phasors)),
        tuple(AnalogChannel(f"A{i}") for i in range(analogs)),
        tuple(DigitalWord((f"D{i}",) * 16) for i in range(digitals)),
    )
    return ConfigFrame(Prefix(7, 0, 0), (pmu,), 60)


@st.composite
def frames(draw: st.DrawFn) -> tuple[DataFrame, ConfigFrame]:
    """Draw values that both the 16-bit and the float format can carry, and a format."""
    volts = st.floats(-290e3, 290e3, width=32).filter(lambda x: x == 0 or abs(x) > 1e-3)
    phasors = tuple(draw(st.lists(st.builds(complex, volts, volts), max_size=4)))
    analogs = tuple(float(x) for x in draw(st.lists(st.integers(-32767, 32767), max_size=3)))
    digitals = tuple(draw(st.lists(st.integers(0, 0xFFFF), max_size=2)))
    pmu = PmuData(
        draw(st.integers(0, 0xFFFF)),
        phasors,
        draw(st.floats(30.0, 90.0, width=32)),
        draw(st.floats(-300.0, 300.0, width=32)),
        analogs,
        digitals,
    )
    prefix = Prefix(
        7,
        draw(st.integers(0, 2**32 - 1)),
        draw(st.integers(0, 999_999)),
        draw(st.integers(0, 255)),
        draw(st.sampled_from([1, 2])),
    )
    config = config_of(draw(FORMATS), len(phasors), len(analogs), len(digitals))
    return DataFrame(prefix, (pmu,)), config


@given(frames())
def test_values_come_back_within_the_resolution_of_their_words(
    drawn: tuple[DataFrame, ConfigFrame],
) -> None:
    """Otherwise what a controller reads is not what the PMU measured."""
    frame, config = drawn
    got = DataFrame.from_bytes(frame.to_bytes(config), config)
    assert got.prefix == frame.prefix
    (before,), (after,), form = frame.pmus, got.pmus, config.pmus[0].format
    assert (after.stat, after.analogs, after.digitals) == (
        before.stat,
        before.analogs,
        before.digitals,
    )
    # half a unit of the last place: 1 mHz and 0.01 Hz/s as 16 bits (and the rounding of adding the
    # nominal 60 Hz), none as 32-bit floats, which the drawn values are
    is_float = FormatBit.FLOAT_FREQ in form
    assert abs(after.f_hz - before.f_hz) <= (0.0 if is_float else 0.5e-3 + 1e-12)
    assert abs(after.rocof_hz_s - before.rocof_hz_s) <= (0.0 if is_float else 0.5e-2 + 1e-12)
    for mine, theirs in zip(after.phasors, before.phasors, strict=True):
        assert abs(mine - theirs) <= phasor_resolution(form, abs(theirs))


def phasor_resolution(form: FormatBit, magnitude: float) -> float:
    """Return the greatest error of a phasor in V that rounding its two words explains."""
    bit_v = SCALE * 1e-5
    if FormatBit.FLOAT_PHASORS in form:
        # 2**-24 relative in the magnitude, up to pi * 2**-24 rad in the angle
        return 4.5 * 2.0**-24 * magnitude if FormatBit.POLAR in form else 0.0
    if FormatBit.POLAR in form:
        return 0.5 * bit_v + 0.5e-4 * (magnitude + bit_v) + 1e-6
    return math.hypot(0.5 * bit_v, 0.5 * bit_v) + 1e-6


@given(frames())
def test_rectangular_frames_are_written_back_byte_for_byte(
    drawn: tuple[DataFrame, ConfigFrame],
) -> None:
    """Otherwise a concentrator that passes frames on alters them."""
    frame, config = drawn
    pmu = config.pmus[0]
    flat = config_of(
        pmu.format & ~FormatBit.POLAR, *map(len, (pmu.phasors, pmu.analogs, pmu.digitals))
    )
    data = frame.to_bytes(flat)
    assert DataFrame.from_bytes(data, flat).to_bytes(flat) == data


@given(frames(), st.data())
def test_every_flipped_bit_is_found(
    drawn: tuple[DataFrame, ConfigFrame], data: st.DataObject
) -> None:
    """Otherwise a controller acts on what a noisy line made of a frame."""
    frame, config = drawn
    sound = frame.to_bytes(config)
    bit = data.draw(st.integers(0, 8 * len(sound) - 1))
    broken = bytearray(sound)
    broken[bit // 8] ^= 1 << bit % 8
    with pytest.raises(FrameError):
        DataFrame.from_bytes(bytes(broken), config)


@pytest.mark.parametrize("form", [FormatBit(0), FormatBit.POLAR, FormatBit(0xF)])
def test_a_missing_measurement_stays_missing(form: FormatBit) -> None:
    """Otherwise a PMU without a measurement reports -32768 as one."""
    config = config_of(form, 1, 0, 0)
    absent = PmuData(0x8000, (complex(math.nan, math.nan),), math.nan, math.nan)
    (got,) = DataFrame.from_bytes(
        DataFrame(Prefix(7, 0, 0), (absent,)).to_bytes(config), config
    ).pmus
    assert cmath.isnan(got.phasors[0])
    assert math.isnan(got.f_hz)
    assert math.isnan(got.rocof_hz_s)
    assert got.error is DataError.TEST_MODE_OR_ABSENT


def a_frame() -> tuple[bytearray, ConfigFrame]:
    """Return a sound frame as bytes that can be altered, and its configuration."""
    config = config_of(FormatBit(0xE), 1, 0, 0)
    pmu = PmuData(0, (1000 + 0j,), 60.0, 0.0)
    return bytearray(DataFrame(Prefix(7, 5, 6), (pmu,)).to_bytes(config)), config


def with_new_crc(data: bytearray) -> bytes:
    """Return `data` with a check word that fits its bytes."""
    return bytes(data[:-2]) + struct.pack(">H", crc_of(bytes(data[:-2])))


def test_what_is_wrong_with_a_frame_is_said() -> None:
    """Otherwise nobody can tell a broken line from a wrong configuration."""
    data, config = a_frame()
    cases = {
        "at least 16 bytes.*got 3": bytes(data[:3]),
        "SYNC of a DATA frame must be 0xAA01 or 0xAA02 .got 0xAB01": b"\xab" + bytes(data[1:]),
        "got 0xAA31": b"\xaa\x31" + bytes(data[2:]),
        "got 0xAA03": b"\xaa\x03" + bytes(data[2:]),
        "FRAMESIZE of IDCODE 7 says 34 bytes, 33 came": bytes(data[:-1]),
        f"CHK of IDCODE 7 is 0x0000, its bytes give 0x{crc_of(bytes(data[:-2])):04X}": (
            bytes(data[:-2]) + b"\0\0"
        ),
        "IDCODE 9 is unknown: the configuration describes stream 7": with_new_crc(
            data[:4] + b"\0\x09" + data[6:]
        ),
    }
    for message, wrong in cases.items():
        with pytest.raises(FrameError, match=message):
            DataFrame.from_bytes(wrong, config)


def test_a_frame_of_another_layout_is_refused() -> None:
    """Otherwise analogs are read as frequencies after a PMU was set up anew."""
    data, _ = a_frame()
    with pytest.raises(FrameError, match="ends 8 bytes before its last word"):
        DataFrame.from_bytes(bytes(data), config_of(FormatBit(0xE), 2, 0, 0))
    with pytest.raises(FrameError, match="has 8 bytes after its last word"):
        DataFrame.from_bytes(bytes(data), config_of(FormatBit(0xE), 0, 0, 0))


@pytest.mark.parametrize(
    ("form", "pmu", "message"),
    [
        (0, PmuData(0, (400e3 + 0j,), 60.0, 0.0), "phasor 'P0' .* does not fit"),
        (1, PmuData(0, (700e3 + 0j,), 60.0, 0.0), "phasor 'P0' .* does not fit"),
        (0, PmuData(0, (0j,), 100.0, 0.0), "FREQ and DFREQ .* does not fit"),
        (15, PmuData(0, (0j,), 1e39, 0.0), "FREQ and DFREQ .* does not fit"),
        (0, PmuData(0, (0j,), 60.0, math.inf), "inf does not fit"),
        (0, PmuData(1 << 16, (0j,), 60.0, 0.0), "STAT .* does not fit"),
        (0, PmuData(0, (), 60.0, 0.0), r"\(1, 0, 0\) phasors, analogs and digitals"),
    ],
)
def test_a_value_that_its_word_cannot_carry_is_refused(
    form: int, pmu: PmuData, message: str
) -> None:
    """Otherwise it wraps round to a plausible wrong one."""
    with pytest.raises(FrameError, match=message):
        DataFrame(Prefix(7, 0, 0), (pmu,)).to_bytes(config_of(FormatBit(form), 1, 0, 0))


def test_an_integer_phasor_needs_a_scale() -> None:
    """Otherwise every voltage is sent as zero."""
    pmu = PmuConfig("station", 7, FormatBit(0), (PhasorChannel("V1"),))
    frame = DataFrame(Prefix(7, 0, 0), (PmuData(0, (1j,), 60.0, 0.0),))
    with pytest.raises(FrameError, match="'V1' in 16 bits needs a scale"):
        frame.to_bytes(ConfigFrame(Prefix(7, 0, 0), (pmu,), 60))


@pytest.mark.parametrize(
    ("prefix", "message"),
    [
        (Prefix(0, 0, 0), r"IDCODE must be 1 to 65534 \(got 0\)"),
        (Prefix(7, 1 << 32, 0), "SOC must be"),
        (Prefix(7, 0, 1 << 24), "FRACSEC must be"),
        (Prefix(7, 0, 0, 256), "time quality must be"),
        (Prefix(7, 0, 0, 0, 3), "version must be 1 to 2"),
    ],
)
def test_a_prefix_out_of_range_is_refused(prefix: Prefix, message: str) -> None:
    """Otherwise one word of the prefix spills into the next."""
    config = ConfigFrame(Prefix(prefix.idcode, 0, 0), config_of(FormatBit(15), 0, 0, 0).pmus, 60)
    with pytest.raises(FrameError, match=message):
        DataFrame(prefix, (PmuData(0, (), 60.0, 0.0),)).to_bytes(config)


def test_a_frame_for_another_number_of_pmus_is_refused() -> None:
    """Otherwise a concentrator's frame shifts the values of one PMU to the next."""
    config = config_of(FormatBit(15), 0, 0, 0)
    with pytest.raises(FrameError, match=r"stream 7 has 1 PMUs \(got 0\)"):
        DataFrame(Prefix(7, 0, 0), ()).to_bytes(config)
