"""Many data frames at once, each of 34 bytes: one rectangular float phasor, FREQ and DFREQ.

The bytes are those of `DataFrame.to_bytes` with `stream_config`; only the speed differs.
"""

from enum import IntEnum
from typing import Any, NamedTuple

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
from tieline.compiled import compiled, compiled_in_place
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

_PLACES = {name: int(place) for name, (_, place, *_) in (FRAME.fields or {}).items()}
_SYNC_AT, _SIZE_AT, _IDCODE_AT, _SOC_AT, _FRACSEC_AT, _STAT_AT = (
    _PLACES[name] for name in ("SYNC", "FRAMESIZE", "IDCODE", "SOC", "FRACSEC", "STAT")
)
_PHASOR_AT, _FREQ_AT, _DFREQ_AT, _CHK_AT = (
    _PLACES[name] for name in ("PHASOR", "FREQ", "DFREQ", "CHK")
)
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
    n = len(phasors)
    return _written(
        _column(idcodes, n, np.uint16),
        int(np.uint32(soc)),
        time_quality << 24 | fracsec,
        _column(stat, n, np.uint16),
        np.ascontiguousarray(phasors, np.complex128),
        _column(f_hz, n, np.float64),
        _column(rocof_hz_s, n, np.float64),
    )


def _column(values: ArrayLike, n: int, dtype: type[np.generic]) -> NDArray[Any]:
    """Return (n,) values that may be given as one for all."""
    column = np.ascontiguousarray(values, dtype)
    return column if column.shape == (n,) else np.ascontiguousarray(np.broadcast_to(column, n))


def decode_frames(payloads: NDArray[np.uint8]) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
    """Return the words (n,) of `FRAME` in each payload, and a `Verdict` (n,) uint8 on each.

    Words of a frame that is not sound mean nothing. Payloads (n, size) of another size than 34
    bytes are all refused for it, and their words are zero.
    """
    n, size = payloads.shape
    if size != FRAME_BYTES:
        return np.zeros(n, FRAME), np.full(n, Verdict.SIZE, np.uint8)
    rows = np.ascontiguousarray(payloads)
    return rows.view(FRAME).reshape(n), _read(rows, 0)[0]


class Frames(NamedTuple):
    """What m frames say, all (m,).

    Attributes:
        verdicts: uint8, a `Verdict`; the rest means nothing where it is not `SOUND`.
        idcodes: number of the stream.
        tags_ns: time tag, ns since the start of the run.
        f_hz: frequency, Hz.
    """

    verdicts: NDArray[np.uint8]
    idcodes: NDArray[np.int64]
    tags_ns: NDArray[np.int64]
    f_hz: NDArray[np.float64]


def read_frames(payloads: NDArray[np.uint8], epoch_s: int = 0) -> Frames:
    """Return what a controller takes from frames (m, size); another size than 34 is refused."""
    m, size = payloads.shape
    if size != FRAME_BYTES:
        none = np.zeros(m, np.int64)
        return Frames(np.full(m, _SIZE, np.uint8), none, none, np.zeros(m))
    return Frames(*_read(np.ascontiguousarray(payloads), epoch_s))


@compiled
def _written(
    idcodes: NDArray[np.uint16],
    soc: int,
    fracsec: int,
    stat: NDArray[np.uint16],
    phasors: NDArray[np.complex128],
    f_hz: NDArray[np.float64],
    rocof_hz_s: NDArray[np.float64],
) -> NDArray[np.uint8]:
    """Return the frames (n, 34) of n streams, each column (n,)."""
    rows = np.empty((len(phasors), FRAME_BYTES), np.uint8)
    for i in range(len(rows)):
        row = rows[i]
        _put(row, _SYNC_AT, _SYNC_2005)
        _put(row, _SIZE_AT, FRAME_BYTES)
        _put(row, _IDCODE_AT, idcodes[i])
        _put_long(row, _SOC_AT, soc)
        _put_long(row, _FRACSEC_AT, fracsec)
        _put(row, _STAT_AT, stat[i])
        _put_float(row, _PHASOR_AT, phasors[i].real)
        _put_float(row, _PHASOR_AT + 4, phasors[i].imag)
        _put_float(row, _FREQ_AT, f_hz[i])
        _put_float(row, _DFREQ_AT, rocof_hz_s[i])
    crc = crc_of_rows(rows[:, :_CHK_AT])
    for i in range(len(rows)):
        _put(rows[i], _CHK_AT, crc[i])
    return rows


@compiled
def _read(
    rows: NDArray[np.uint8], epoch_s: int
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the columns of `Frames` from the frames' bytes (m, 34)."""
    m = len(rows)
    verdicts, idcodes = np.empty(m, np.uint8), np.empty(m, np.int64)
    tags_ns, f_hz = np.empty(m, np.int64), np.empty(m)
    crc = crc_of_rows(rows[:, :_CHK_AT])
    for i in range(m):
        row = rows[i]
        verdicts[i] = _judge(row, crc[i])
        idcodes[i] = _word(row, _IDCODE_AT)
        seconds, fracsec = _long(row, _SOC_AT) - epoch_s, _long(row, _FRACSEC_AT) & 0xFFFFFF
        tags_ns[i] = seconds * NS_PER_S + fracsec * (NS_PER_S // TIME_BASE)
        f_hz[i] = np.uint32(_long(row, _FREQ_AT)).view(np.float32)
    return verdicts, idcodes, tags_ns, f_hz


@compiled_in_place
def _judge(row: NDArray[np.uint8], crc: int) -> int:
    """Return the `Verdict` on a frame (34,) whose bytes have a CRC."""
    sync = _word(row, _SYNC_AT)
    if _word(row, _SIZE_AT) != FRAME_BYTES:
        return _SIZE
    if sync != _SYNC_2005 and sync != _SYNC_2011:
        return _BAD_SYNC
    if _word(row, _CHK_AT) != crc:
        return _CRC
    if _word(row, _STAT_AT) & _ERROR_BITS:
        return _DATA_ERROR
    if _word(row, _FREQ_AT) & _EXPONENT == _EXPONENT:
        return _NO_FREQUENCY
    return _SOUND


@compiled_in_place
def _word(row: NDArray[np.uint8], at: int) -> int:
    """Return the two bytes at a place as the number that they send."""
    return int(row[at]) << 8 | int(row[at + 1])


@compiled_in_place
def _long(row: NDArray[np.uint8], at: int) -> int:
    """Return the four bytes at a place as the number that they send."""
    return _word(row, at) << 16 | _word(row, at + 2)


@compiled_in_place
def _put(row: NDArray[np.uint8], at: int, value: int) -> None:
    """Write the low two bytes of a number at a place."""
    row[at], row[at + 1] = (value >> 8) & 0xFF, value & 0xFF


@compiled_in_place
def _put_long(row: NDArray[np.uint8], at: int, value: int) -> None:
    """Write the low four bytes of a number at a place."""
    _put(row, at, value >> 16)
    _put(row, at + 2, value)


@compiled_in_place
def _put_float(row: NDArray[np.uint8], at: int, value: float) -> None:
    """Write a number at a place in single precision."""
    _put_long(row, at, int(np.float32(value).view(np.uint32)))
