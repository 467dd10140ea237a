"""Writes pixels as a PNG file (ISO/IEC 15948)."""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

INCH_M = 0.0254

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_BITS, _RGB = 8, 2
_UP = 2
"""The filter that keeps of each row what differs from the row above: of drawings, little."""
_LEVEL = 1
"""Of compression: 6 takes twice the time for files a tenth smaller."""


def write_png(path: Path, pixels: NDArray[np.uint8], dots_per_inch: float) -> None:
    """Write a picture.

    Args:
        path: of the file.
        pixels: (height, width, 3 or more), red, green and blue; what follows is left out.
        dots_per_inch: at which it has the size that it is meant to have.
    """
    height, width, _ = pixels.shape
    filtered = np.empty((height, 1 + 3 * width), np.uint8)
    filtered[:, 0] = _UP
    for colour in range(3):
        of_it, into = pixels[..., colour], filtered[:, 1 + colour :: 3]
        into[0] = of_it[0]
        np.subtract(of_it[1:], of_it[:-1], out=into[1:])
    per_metre = round(dots_per_inch / INCH_M)
    chunks = (
        _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, _BITS, _RGB, 0, 0, 0)),
        _chunk(b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1)),
        _chunk(b"IDAT", zlib.compress(filtered.tobytes(), _LEVEL)),
        _chunk(b"IEND", b""),
    )
    path.write_bytes(_SIGNATURE + b"".join(chunks))


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(content, zlib.crc32(kind))
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)
