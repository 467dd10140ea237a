"""Many frames at once are the same frames as one by one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tieline.c37118 import ConfigFrame, DataFrame, PmuData, Prefix
from tieline.c37118.batch import (
    FRAME_BYTES,
    Verdict,
    decode_frames,
    encode_frames,
    read_frames,
    stream_config,
)
from tieline.c37118.timestamp import soc_fracsec
from tieline.errors import FrameError

EPOCH_S = 1_700_000_000
SINGLE = st.floats(-1e6, 1e6, width=32)
STREAMS = st.lists(
    st.tuples(st.integers(1, 65534), SINGLE, SINGLE, SINGLE, SINGLE, st.integers(0, 0xFFFF)),
    max_size=8,
)


def encode(streams: list[tuple], time_ns: int, quality: int = 0) -> np.ndarray:
    """Return the frames of streams given as (idcode, real, imaginary, f, rocof, stat)."""
    columns = list(zip(*streams, strict=True)) if streams else [()] * 6
    idcodes, real, imaginary, f_hz, rocof, stat = columns
    # by parts: real + 1j * imaginary would lose the sign of a zero
    phasors = np.empty(len(streams), complex)
    phasors.real, phasors.imag = real, imaginary
    return encode_frames(
        np.array(idcodes, np.uint16),
        time_ns,
        phasors,
        f_hz,
        rocof,
        epoch_s=EPOCH_S,
        stat=np.array(stat, np.uint16),
        time_quality=quality,
    )


@given(STREAMS, st.integers(0, 10**13), st.integers(0, 255))
def test_a_batch_holds_the_bytes_of_the_frames_one_by_one(
    streams: list[tuple], time_ns: int, quality: int
) -> None:
    """Otherwise what crosses the simulated network is not IEEE C37.118.2."""
    rows = encode(streams, time_ns, quality)
    assert rows.shape == (len(streams), FRAME_BYTES)
    for row, (idcode, real, imaginary, f_hz, rocof, stat) in zip(rows, streams, strict=True):
        pmu = PmuData(stat, (complex(real, imaginary),), f_hz, rocof)
        frame = DataFrame(Prefix(idcode, *soc_fracsec(time_ns, EPOCH_S), quality), (pmu,))
        config = stream_config(idcode, "bus", 60, 60)
        assert row.tobytes() == frame.to_bytes(config)
        assert DataFrame.from_bytes(row.tobytes(), config) == frame


@given(STREAMS, st.integers(0, 10**13))
def test_a_batch_is_read_as_it_was_written(streams: list[tuple], time_ns: int) -> None:
    """Otherwise a controller believes another frequency than was measured."""
    rows = encode([(*stream[:5], 0x2000) for stream in streams], time_ns)
    frames, verdicts = decode_frames(np.frombuffer(rows.tobytes(), np.uint8).reshape(rows.shape))
    assert verdicts.tolist() == [Verdict.SOUND] * len(streams)
    assert frames["IDCODE"].tolist() == [stream[0] for stream in streams]
    assert frames["FREQ"].tolist() == [stream[3] for stream in streams]
    # the tag is the instant rounded to microseconds, half up
    assert set(read_frames(rows, EPOCH_S).tags_ns) <= {(time_ns + 500) // 1000 * 1000}


@given(st.integers(0, 8 * FRAME_BYTES - 1))
def test_every_flipped_bit_is_found_in_a_batch(bit: int) -> None:
    """Otherwise the fast reader accepts what the careful one refuses."""
    rows = encode([(7, 1.0, 2.0, 60.0, 0.0, 0)], 0)
    rows[0, bit // 8] ^= 1 << bit % 8
    _, verdicts = decode_frames(rows)
    assert verdicts[0] in (Verdict.SIZE, Verdict.SYNC, Verdict.CRC)
    with pytest.raises(FrameError):
        DataFrame.from_bytes(rows.tobytes(), stream_config(7, "bus", 60, 60))


@pytest.mark.parametrize("stat", [0x4000, 0x8000, 0xC000, 0xFFFF])
def test_values_that_must_not_be_used_are_marked(stat: int) -> None:
    """Otherwise a PMU in test mode moves the average of the whole system."""
    assert decode_frames(encode([(7, 1.0, 0.0, 60.0, 0.0, stat)], 0))[1][0] == Verdict.DATA_ERROR


@pytest.mark.parametrize("f_hz", [np.nan, np.inf, -np.inf])
def test_a_frame_without_a_frequency_is_marked(f_hz: float) -> None:
    """Otherwise one missing frequency makes every average NaN for ever."""
    assert decode_frames(encode([(7, 1.0, 0.0, f_hz, 0.0, 0)], 0))[1][0] == Verdict.NO_FREQUENCY


def test_frames_of_the_2011_version_are_read_too() -> None:
    """Otherwise PMUs that write version 2 into SYNC are not understood."""
    config = stream_config(7, "bus", 60, 60)
    frame = DataFrame(Prefix(7, 0, 0, version=2), (PmuData(0, (1j,), 60.5, 0.0),))
    row = np.frombuffer(frame.to_bytes(config), np.uint8).reshape(1, -1)
    frames, verdicts = decode_frames(row)
    assert verdicts[0] == Verdict.SOUND
    assert frames["FREQ"][0] == 60.5


def test_frames_of_another_size_are_all_marked() -> None:
    """Otherwise the words of a larger frame are read at the wrong places."""
    frames, verdicts = decode_frames(np.zeros((3, 42), np.uint8))
    assert verdicts.tolist() == [Verdict.SIZE] * 3
    assert len(frames) == 3


def test_the_stream_s_configuration_is_a_sound_frame() -> None:
    """Otherwise a foreign receiver cannot be told what our frames hold."""
    config = stream_config(65534, "B61", 50, 60, EPOCH_S)
    assert ConfigFrame.from_bytes(config.to_bytes()) == config
    assert config.data_rate == 60
    assert config.pmus[0].f0_hz == 50
