"""Many data frames at once, each of 34 bytes: one rectangular float phasor, FREQ and DFREQ.

The bytes are those of `DataFrame.to_bytes` with `stream_config`; only the speed differs.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tieline.c37118.config import ConfigFrame, PhasorChannel, PmuConfig
from tieline.c37118.constants import (
    IDCODES,
    SYNC_BYTE,
    TIME_BASE,
    VERSIONS,
    FormatBit,
    FrameType,
    StatBit,
)
from tieline.c37118.crc import crc_of_rows
from tieline.c37118.prefix import Prefix
from tieline.c37118.timestamp import soc_fracsec
from tieline.compiled import compiled
from tieline.errors import InputError
from tieline.units import NS_PER_S

FRAME = np.dtype(
    [
        ("SYNC", ">u2"),
        ("FRAMESIZE", ">u2"),
        ("IDCODE", ">u2"),
        ("SOC", ">u4"),
        ("FRACSEC", ">u4"),
        ("STAT", ">u2"),
        ("PHASOR", ">f4", 2),
        ("FREQ", ">f4"),
        ("DFREQ", ">f4"),
        ("CHK", ">u2"),
    ]
)
"""Layout of one frame (Table 5 with one PMU, one phasor, no analogs and no digitals)."""

FRAME_BYTES = FRAME.itemsize

_CHK_BYTES = 2
_PLACES = {name: int(place) for name, (_, place, *_) in (FRAME.fields or {}).items()}
_SYNC_AT, _SIZE_AT, _STAT_AT = _PLACES["SYNC"], _PLACES["FRAMESIZE"], _PLACES["STAT"]
_FREQ_AT, _CHK_AT = _PLACES["FREQ"], _PLACES["CHK"]
_EXPONENT = 0x7F80
"""Bits of a float's first word that are all 1 where it is not finite (IEEE 754)."""
_SYNC_2005, _SYNC_2011 = (SYNC_BYTE << 8 | FrameType.DATA << 4 | version for version in VERSIONS)
_ERROR_BITS = StatBit.DATA_ERROR.value


class Verdict(IntEnum):
    """What is wrong with a frame: the first of these that holds."""

    SOUND = 0
    SIZE = 1
    SYNC = 2
    CRC = 3
    DATA_ERROR = 4
    NO_FREQUENCY = 5


# Compiled code takes plain integers as constants.
_SOUND, _SIZE, _BAD_SYNC, _CRC, _DATA_ERROR, _NO_FREQUENCY = (int(verdict) for verdict in Verdict)


def checked_idcodes(idcodes: ArrayLike) -> NDArray[np.uint16]:
    """Return the numbers (n,) of some streams.

    Raises:
        InputError: there are none, two are equal, or one is reserved or out of range.
    """
    numbers = np.asarray(idcodes, np.int64)
    is_allowed = (numbers >= IDCODES.start) & (numbers < IDCODES.stop)
    if not numbers.size or len(np.unique(numbers)) != len(numbers) or not is_allowed.all():
        raise InputError(
            f"data streams need distinct numbers from {IDCODES.start} to {IDCODES.stop - 1} "
            f"(got {numbers.tolist()})"
        )
    return numbers.astype(np.uint16)


def stream_config(idcode: int, station: str, f0_hz: int, rate_hz: int, soc: int = 0) -> ConfigFrame:
    """Return the configuration of a stream of these frames, for `DataFrame` or a foreign receiver.

    Args:
        idcode: number of the stream and of its PMU.
        station: name of the PMU, at most 16 ASCII characters.
        f0_hz: nominal frequency, 50 or 60.
        rate_hz: frames a second.
        soc: time tag of the configuration frame, s.
    """
    form = FormatBit.FLOAT_PHASORS | FormatBit.FLOAT_FREQ
    pmu = PmuConfig(station, idcode, form, (PhasorChannel("V1"),), f0_hz=f0_hz)
    return ConfigFrame(Prefix(idcode, soc, 0), (pmu,), rate_hz)


def encode_frames(
    idcodes: ArrayLike,
    time_ns: int,
    phasors: NDArray[np.complex128],
    f_hz: ArrayLike,
    rocof_hz_s: ArrayLike,
    *,
    epoch_s: int = 0,
    stat: ArrayLike = 0,
    time_quality: int = 0,
) -> NDArray[np.uint8]:
    """Return the frames (n, 34) of n streams measured at one instant.

    Args:
        idcodes: (n,) numbers of the streams.
        time_ns: instant of the measurement, ns since the start of the run.
        phasors: (n,) V, RMS.
        f_hz: (n,) frequencies, Hz.
        rocof_hz_s: (n,) rates of change of frequency, Hz/s.
        epoch_s: SOC of the start of the run, s since 1970-01-01 UTC.
        stat: (n,) or one STAT word; see `StatBit`.
        time_quality: time quality byte of every frame (Tables 3 and 4).
    """
    soc, fracsec = soc_fracsec(time_ns, epoch_s)
    frames = np.zeros(len(phasors), FRAME)
    frames["SYNC"] = _SYNC_2005
    frames["FRAMESIZE"] = FRAME_BYTES
    frames["IDCODE"] = idcodes
    frames["SOC"] = soc
    frames["FRACSEC"] = time_quality << 24 | fracsec
    frames["STAT"] = stat
    frames["PHASOR"][:, 0] = phasors.real
    frames["PHASOR"][:, 1] = phasors.imag
    frames["FREQ"] = f_hz
    frames["DFREQ"] = rocof_hz_s
    rows = frames.view(np.uint8).reshape(len(frames), FRAME_BYTES)
    frames["CHK"] = crc_of_rows(rows[:, :-_CHK_BYTES])
    return rows


def decode_frames(payloads: NDArray[np.uint8]) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
    """Return the words (n,) of `FRAME` in each payload, and a `Verdict` (n,) uint8 on each.

    Words of a frame that is not sound mean nothing. Payloads (n, size) of another size than 34
    bytes are all refused for it, and their words are zero.
    """
    n, size = payloads.shape
    if size != FRAME_BYTES:
        return np.zeros(n, FRAME), np.full(n, Verdict.SIZE, np.uint8)
    rows = np.ascontiguousarray(payloads)
    return rows.view(FRAME).reshape(n), _judge(rows, crc_of_rows(rows[:, :-_CHK_BYTES]))


def times_ns(frames: NDArray[np.void], epoch_s: int = 0) -> NDArray[np.int64]:
    """Return the time tags (n,) of `frames`, in ns since the start of the run."""
    fracsec = frames["FRACSEC"].astype(np.int64) & 0xFFFFFF
    seconds = frames["SOC"].astype(np.int64) - epoch_s
    return seconds * NS_PER_S + fracsec * (NS_PER_S // TIME_BASE)


@compiled
def _judge(rows: NDArray[np.uint8], crc: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return the `Verdict` on each frame (n,) from its bytes (n, 34) and their CRC (n,)."""
    verdicts = np.full(len(rows), _SOUND, np.uint8)
    for i in range(len(rows)):
        row = rows[i]
        sync = _word(row, _SYNC_AT)
        if _word(row, _SIZE_AT) != FRAME_BYTES:
            verdicts[i] = _SIZE
        elif sync != _SYNC_2005 and sync != _SYNC_2011:
            verdicts[i] = _BAD_SYNC
        elif _word(row, _CHK_AT) != crc[i]:
            verdicts[i] = _CRC
        elif _word(row, _STAT_AT) & _ERROR_BITS:
            verdicts[i] = _DATA_ERROR
        elif _word(row, _FREQ_AT) & _EXPONENT == _EXPONENT:
            verdicts[i] = _NO_FREQUENCY
    return verdicts


@compiled
def _word(row: NDArray[np.uint8], at: int) -> int:
    """Return the two bytes at a place as the number that they send."""
    return int(row[at]) << 8 | int(row[at + 1])
