"""The check word CHK (Annex B): CRC-CCITT, x^16 + x^12 + x^5 + 1, started at 0xFFFF."""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled

_POLYNOMIAL = 0x1021
_START = 0xFFFF


def _table() -> NDArray[np.int64]:
    """Return the remainder (256,) that each value of the leading byte leaves."""
    remainder = np.arange(256, dtype=np.int64) << 8
    for _ in range(8):
        carry = np.where(remainder & 0x8000, _POLYNOMIAL, 0)
        remainder = ((remainder << 1) & 0xFFFF) ^ carry
    return remainder


_TABLE = _table()


@compiled
def crc_of_rows(rows: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the CRC (n,) of each row of `rows` (n, size)."""
    n, size = rows.shape
    out = np.empty(n, np.uint16)
    for i in range(n):
        crc = _START
        for j in range(size):
            crc = ((crc << 8) & 0xFFFF) ^ _TABLE[(crc >> 8) ^ rows[i, j]]
        out[i] = crc
    return out


def crc_of(data: bytes) -> int:
    """Return the CRC of `data`."""
    return int(crc_of_rows(np.frombuffer(data, np.uint8).reshape(1, -1))[0])
