"""What every frame begins and ends with (Table 2): SYNC, FRAMESIZE, IDCODE, SOC, FRACSEC; CHK."""

import struct
from dataclasses import dataclass

from tieline.c37118.constants import IDCODES, SYNC_BYTE, VERSIONS, FrameType
from tieline.c37118.crc import crc_of
from tieline.errors import FrameError

_WORDS = struct.Struct(">BBHHII")
_CHK_BYTES = 2
_LEAST_BYTES = _WORDS.size + _CHK_BYTES
_MOST_BYTES = 0xFFFF


@dataclass(frozen=True)
class Prefix:
    """Whose frame it is and when it was made.

    Attributes:
        idcode: number of the data stream, 1 to 65534.
        soc: seconds since 1970-01-01 UTC, leap seconds not counted.
        fracsec: ticks of the stream's TIME_BASE since that second, 24 bits.
        time_quality: leap second flags and clock quality code, 8 bits (Tables 3 and 4).
        version: 1 for frames known since IEEE C37.118-2005, 2 for those added in 2011.
    """

    idcode: int
    soc: int
    fracsec: int
    time_quality: int = 0
    version: int = 1


def wrap(frame_type: FrameType, prefix: Prefix, body: bytes) -> bytes:
    """Return the whole frame: prefix, `body` and check word.

    Raises:
        FrameError: a word of the prefix is out of its range, or the frame is above 65,535 bytes.
    """
    size = _LEAST_BYTES + len(body)
    for name, value, allowed in (
        ("IDCODE", prefix.idcode, IDCODES),
        ("SOC", prefix.soc, range(1 << 32)),
        ("FRACSEC", prefix.fracsec, range(1 << 24)),
        ("time quality", prefix.time_quality, range(1 << 8)),
        ("version", prefix.version, range(VERSIONS[0], VERSIONS[-1] + 1)),
        ("FRAMESIZE", size, range(_MOST_BYTES + 1)),
    ):
        if value not in allowed:
            raise FrameError(f"{name} must be {allowed.start} to {allowed.stop - 1} (got {value})")
    kind = frame_type << 4 | prefix.version
    fracsec = prefix.time_quality << 24 | prefix.fracsec
    frame = _WORDS.pack(SYNC_BYTE, kind, size, prefix.idcode, prefix.soc, fracsec) + body
    return frame + struct.pack(">H", crc_of(frame))


def unwrap(frame_type: FrameType, data: bytes) -> tuple[Prefix, bytes]:
    """Return the prefix of a frame of one type, and its body without the check word.

    Raises:
        FrameError: the bytes are no frame of this type, their number is not FRAMESIZE, or the check
            word does not fit them.
    """
    if len(data) < _LEAST_BYTES:
        raise FrameError(f"a frame has at least {_LEAST_BYTES} bytes (got {len(data)})")
    sync, kind, size, idcode, soc, fracsec = _WORDS.unpack_from(data)
    version = kind & 0xF
    if sync != SYNC_BYTE or kind >> 4 != frame_type or version not in VERSIONS:
        expected = " or ".join(f"0x{SYNC_BYTE:02X}{frame_type << 4 | v:02X}" for v in VERSIONS)
        raise FrameError(
            f"SYNC of a {frame_type.name} frame must be {expected} (got 0x{sync:02X}{kind:02X})"
        )
    if size != len(data):
        raise FrameError(f"FRAMESIZE of IDCODE {idcode} says {size} bytes, {len(data)} came")
    given, expected_crc = int.from_bytes(data[-_CHK_BYTES:], "big"), crc_of(data[:-_CHK_BYTES])
    if given != expected_crc:
        raise FrameError(
            f"CHK of IDCODE {idcode} is 0x{given:04X}, its bytes give 0x{expected_crc:04X}"
        )
    prefix = Prefix(idcode, soc, fracsec & 0xFFFFFF, fracsec >> 24, version)
    return prefix, data[_WORDS.size : -_CHK_BYTES]
