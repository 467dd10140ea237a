"""The frames that Annex D of IEEE Std C37.118.2-2011 shows, byte for byte.

Taken in hexadecimal from the frame validation test of pyPMU (github.com/iicsys/pypmu,
tests/validate_frames.py), which names the annex as its source. They describe one PMU with four
phasors, three analogs and a word of sixteen breaker states.
"""

import cmath
import math

import pytest

from tieline.c37118 import (
    AnalogChannel,
    Command,
    CommandFrame,
    ConfigFrame,
    DataError,
    DataFrame,
    DigitalWord,
    FormatBit,
    HeaderFrame,
    PhasorChannel,
    PmuConfig,
    Prefix,
)

DATA = bytes.fromhex(
    "aa0100341e3644853600000041b10000392b0000e36ace7ce36a31830444000009c40000"
    "42c80000447a0000461c40003c12d43f"
)
COMMAND = bytes.fromhex("aa4100121e36448560300f0bbfd00002ce00")
HEADER = bytes.fromhex(
    "aa1100271e36448560300f0bbfd048656c6c6f2049276d20486561646572204672616d652e17cc"
)
NAMES = b"".join(
    name.ljust(16)
    for name in (
        *(b"VA", b"VB", b"VC", b"I1", b"ANALOG1", b"ANALOG2", b"ANALOG3"),
        *(b"BREAKER %c STATUS" % digit for digit in b"123456789ABCDEFG"),
    )
)
CONFIG = (
    bytes.fromhex("aa3101c61e36448527f056071098000f42400001")
    + b"Station A".ljust(16)
    + bytes.fromhex("1e360004000400030001")
    + NAMES
    + bytes.fromhex(
        "000df847000df847000df8470100b2d00000000101000001020000010000ffff00000016001ed5d1"
    )
)


def test_the_configuration_is_read_as_the_annex_explains_it() -> None:
    """Otherwise we misread the configuration of a real PMU."""
    voltages = tuple(PhasorChannel(name, False, 915_527) for name in ("VA", "VB", "VC"))
    analogs = tuple(AnalogChannel(f"ANALOG{i + 1}", i, 1) for i in range(3))
    breakers = DigitalWord(tuple(f"BREAKER {i} STATUS" for i in "123456789ABCDEFG"), 0, 0xFFFF)
    pmu = PmuConfig(
        "Station A",
        7734,
        FormatBit.FLOAT_ANALOGS,
        (*voltages, PhasorChannel("I1", True, 45_776)),
        analogs,
        (breakers,),
        f0_hz=60,
        change_count=22,
    )
    prefix = Prefix(7734, 1_149_577_200, 463_000, time_quality=0x56)
    assert ConfigFrame.from_bytes(CONFIG) == ConfigFrame(prefix, (pmu,), 30, 1_000_000)


def test_the_data_are_read_as_the_annex_explains_them() -> None:
    """Otherwise we misread the measurements of a real PMU.

    The annex: 134.0 kV at 0, -120 and +120 degrees, 500 A at 0 degrees, 62.5 Hz (2,500 mHz above
    60), analogs 100, 1000 and 10000. Its figures are rounded to the digits asserted here.
    """
    frame = DataFrame.from_bytes(DATA, ConfigFrame.from_bytes(CONFIG))
    assert frame.prefix == Prefix(7734, 1_149_580_800, 16_817)
    (pmu,) = frame.pmus
    assert pmu.error is DataError.GOOD
    assert [round(abs(phasor), -2) for phasor in pmu.phasors[:3]] == [134_000.0] * 3
    angles = [math.degrees(cmath.phase(phasor)) for phasor in pmu.phasors[:3]]
    assert angles == pytest.approx([0.0, -120.0, 120.0], abs=0.01)
    assert pmu.phasors[3] == pytest.approx(500.0, abs=0.5)
    assert pmu.f_hz == 62.5
    assert pmu.rocof_hz_s == 0.0
    assert pmu.analogs == (100.0, 1000.0, 10_000.0)
    assert pmu.digitals == (0x3C12,)


def test_command_and_header_are_read_as_the_annex_explains_them() -> None:
    """Otherwise a PMU's stream cannot be started, nor its description read."""
    prefix = Prefix(7734, 1_149_591_600, 770_000, time_quality=0x0F)
    assert CommandFrame.from_bytes(COMMAND) == CommandFrame(prefix, Command.TURN_ON)
    assert HeaderFrame.from_bytes(HEADER) == HeaderFrame(prefix, "Hello I'm Header Frame.")


def test_each_frame_is_written_back_byte_for_byte() -> None:
    """Otherwise other receivers do not understand what we write."""
    config = ConfigFrame.from_bytes(CONFIG)
    assert config.to_bytes() == CONFIG
    assert DataFrame.from_bytes(DATA, config).to_bytes(config) == DATA
    assert CommandFrame.from_bytes(COMMAND).to_bytes() == COMMAND
    assert HeaderFrame.from_bytes(HEADER).to_bytes() == HEADER


def test_a_stream_of_two_pmus_repeats_their_words() -> None:
    """Otherwise the stream of a phasor data concentrator cannot be read (same source)."""
    one = ConfigFrame.from_bytes(CONFIG)
    two = ConfigFrame(one.prefix, one.pmus * 2, one.data_rate)
    data = bytes.fromhex(
        "aa0100581e3644853600000041b1"
        + "0000392b0000e36ace7ce36a31830444000009c4000042c80000447a0000461c40003c12" * 2
        + "bd52"
    )
    frame = DataFrame.from_bytes(data, two)
    assert frame.pmus[0] == frame.pmus[1]
    assert frame.to_bytes(two) == data
    assert len(two.to_bytes()) == 0x374
    assert two.to_bytes()[-2:] == bytes.fromhex("20e8")
