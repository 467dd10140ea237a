"""C37.118 frames: what is decoded goes back to the same bytes; all else is refused.

Frames come as noise, or as sound frames that were edited, most of them with the check word put
right again, so that the fields behind it are reached. A batch decides on each of its frames as the
decoder of a single frame does.
"""

import functools
import math

import numpy as np

from fuzz.script import Script, edited
from tieline.c37118.batch import FRAME_BYTES, Verdict, decode_frames, encode_frames, read_frames
from tieline.c37118.command import CommandFrame, HeaderFrame
from tieline.c37118.config import AnalogChannel, ConfigFrame, DigitalWord, PhasorChannel, PmuConfig
from tieline.c37118.constants import FormatBit
from tieline.c37118.crc import crc_of
from tieline.c37118.data import DataFrame, PmuData
from tieline.c37118.prefix import Prefix
from tieline.errors import FrameError
from tieline.wams import WideAreaAverage

PREFIX = Prefix(7, 1_000_000_000, 123_456)
FORMATS = tuple(FormatBit(bits) for bits in (0, 1, 2, 5, 8, 13, 15))


def one_input(data: bytes) -> None:
    """Decode what an input makes of a frame."""
    script = Script(data)
    kind = script.below(6)
    if kind == 0:
        _batch(script)
        return
    if kind == 1:
        config = _any_config(script)
        _data(_spoilt(script, _data_frame(config)), config)
        return
    whole, decode = _others()[kind - 2]
    frame = _spoilt(script, whole)
    try:
        decoded = decode(frame)
    except FrameError:
        return
    try:
        again = decoded.to_bytes()
    except FrameError:
        # A reserved IDCODE, or a command's extended frame: read, but never written.
        return
    assert decode(again) == decoded
    if isinstance(decoded, ConfigFrame):
        _data(_spoilt(script, _data_frame(_config(FORMATS[0]))), decoded)


def _data(frame: bytes, config: ConfigFrame) -> None:
    try:
        decoded = DataFrame.from_bytes(frame, config)
    except FrameError:
        return
    try:
        again = decoded.to_bytes(config)
    except FrameError:
        # A polar magnitude or an angle that only a scale makes too large for its word.
        return
    assert DataFrame.from_bytes(again, config).prefix == decoded.prefix


def _batch(script: Script) -> None:
    count = 1 + script.below(4)
    rows = encode_frames(np.arange(1, count + 1), 10**9, np.ones(count) * 1e5, 60.0, 0.1)
    frames = [_spoilt(script, row.tobytes())[:FRAME_BYTES] for row in rows]
    payloads = np.frombuffer(b"".join(f.ljust(FRAME_BYTES, b"\0") for f in frames), np.uint8)
    payloads = payloads.reshape(count, FRAME_BYTES)
    _, verdicts = decode_frames(payloads)
    assert (read_frames(payloads).verdicts == verdicts).all()
    config = _config(FormatBit.FLOAT_PHASORS | FormatBit.FLOAT_FREQ, bare=True)
    for payload, verdict in zip(payloads, verdicts, strict=True):
        _check_single(payload.tobytes(), Verdict(int(verdict)), config)
    decode_frames(payloads[:, : script.below(FRAME_BYTES + 1)])
    belief = WideAreaAverage(2, [1, 2])
    belief.deliver(payloads, np.arange(count) % 2, np.arange(count))
    assert np.isfinite(belief.wbar_pu).all(), "an average that is no number"


def _check_single(frame: bytes, verdict: Verdict, config: ConfigFrame) -> None:
    """Hold the batch's verdict against the decoder of single frames."""
    idcode = int.from_bytes(frame[4:6], "big")
    own = ConfigFrame(Prefix(idcode, 0, 0), config.pmus, config.data_rate)
    try:
        decoded = DataFrame.from_bytes(frame, own)
    except FrameError:
        assert verdict in (Verdict.SIZE, Verdict.SYNC, Verdict.CRC), verdict
        return
    [pmu] = decoded.pmus
    expected = Verdict.SOUND if math.isfinite(pmu.f_hz) else Verdict.NO_FREQUENCY
    if pmu.error:
        expected = Verdict.DATA_ERROR
    assert verdict == expected, (verdict, decoded)


def _spoilt(script: Script, whole: bytes) -> bytes:
    manner = script.below(4)
    frame = script.take(200) if manner == 0 else edited(whole, script)
    if manner == 1 or len(frame) < 16:
        return frame
    # FRAMESIZE and CHK are put right, so that what lies behind them is reached.
    frame = frame[:2] + len(frame).to_bytes(2, "big") + frame[4:-2] if manner > 2 else frame[:-2]
    return frame + crc_of(frame).to_bytes(2, "big")


def _any_config(script: Script) -> ConfigFrame:
    return _config(script.one(FORMATS))


@functools.cache
def _config(form: FormatBit, bare: bool = False) -> ConfigFrame:
    phasors = (
        PhasorChannel("VA", scale=10_000),
        PhasorChannel("I1", is_current=True, scale=10_000),
    )
    analogs = (AnalogChannel("ANALOG1", 1, -5),)
    digitals = (DigitalWord(tuple(f"BREAKER {i}" for i in range(16)), 3, 0xFF),)
    pmu = PmuConfig("Station A", 7, form, phasors, analogs, digitals)
    if bare:
        pmu = PmuConfig("Station A", 7, form, phasors[:1])
    return ConfigFrame(PREFIX, (pmu,), 60)


def _data_frame(config: ConfigFrame) -> bytes:
    pmu = PmuData(0, (1.0 + 2.0j, 3.0 + 0.5j), 59.99, 0.02, (1.0,), (5,))
    return DataFrame(PREFIX, (pmu,)).to_bytes(config)


@functools.cache
def _others():  # type: ignore[no-untyped-def]
    return (
        (_config(FORMATS[3]).to_bytes(), ConfigFrame.from_bytes),
        (_config(FORMATS[0], bare=True).to_bytes(), ConfigFrame.from_bytes),
        (CommandFrame(PREFIX, 8, b"own words").to_bytes(), CommandFrame.from_bytes),
        (HeaderFrame(PREFIX, "a header").to_bytes(), HeaderFrame.from_bytes),
    )
