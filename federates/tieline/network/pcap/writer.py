"""Writes classic pcap files of Ethernet frames with nanosecond time stamps."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.errors import CosimError, InputError
from tieline.units import NS_PER_S

FILE_HEADER = np.dtype(
    [
        ("magic", "<u4"),
        ("major", "<u2"),
        ("minor", "<u2"),
        ("zone", "<i4"),
        ("accuracy", "<u4"),
        ("snap_bytes", "<u4"),
        ("link_type", "<u4"),
    ]
)
RECORD_HEADER = np.dtype(
    [("seconds", "<u4"), ("fraction", "<u4"), ("captured_bytes", "<u4"), ("bytes", "<u4")]
)
"""Layout of a pcap file (draft-ietf-opsawg-pcap): the file's header, then records."""

MAGIC_NS, MAGIC_US = 0xA1B23C4D, 0xA1B2C3D4
"""First word of a file whose `fraction` is in nanoseconds, or in microseconds."""

LINKTYPE_ETHERNET = 1

_SNAP_BYTES = 262_144
_SECONDS = range(1 << 32)


class Group(NamedTuple):
    """Frames of one size: `places` (m,) in the block, `frames` (m, size) uint8."""

    places: NDArray[np.int64]
    frames: NDArray[np.uint8]


class PcapWriter:
    """A pcap file that grows by blocks of frames; `path` appears whole at `close`, or not at all.

    Until then the file is called `.NAME.part`; what a killed process leaves there can be renamed
    and read up to the last whole record. Only the block being written is in memory.

    Args:
        path: the file to make.
        epoch_s: time of the simulation's instant 0, whole s since 1970-01-01 UTC, as the frames'
            SOC counts them: with the `epoch_s` of the PMUs, capture times and time tags agree.

    Raises:
        InputError: `epoch_s` does not fit a pcap file.
    """

    def __init__(self, path: Path, epoch_s: int = 0) -> None:
        if epoch_s not in _SECONDS:
            raise InputError(
                f"epoch_s of {path.name} must be 0 to {_SECONDS.stop - 1} s (got {epoch_s})"
            )
        self.path = path
        self.frames = 0
        self._epoch_s = epoch_s
        self._last_ns = 0
        self._part = path.with_name(f".{path.name}.part")
        self._file = self._part.open("wb")
        head = (MAGIC_NS, 2, 4, 0, 0, _SNAP_BYTES, LINKTYPE_ETHERNET)
        self._file.write(np.array(head, FILE_HEADER).tobytes())

    def write(self, times_ns: NDArray[np.int64], groups: Sequence[Group]) -> None:
        """Write a block of frames.

        Args:
            times_ns: (n,) ascending, ns since the simulation's instant 0.
            groups: every place 0 to n - 1 stands in one of them.

        Raises:
            CosimError: a frame is earlier than the one before it, or later than pcap can say.
        """
        if not len(times_ns):
            return
        if (np.diff(times_ns, prepend=self._last_ns) < 0).any():
            raise CosimError(
                f"frame after number {self.frames} of {self.path.name} is out of time order"
            )
        if int(times_ns[-1]) // NS_PER_S + self._epoch_s not in _SECONDS:
            raise CosimError(f"{times_ns[-1]} ns is too late for the times of {self.path.name}")
        self._file.write(self._block(times_ns, groups).data)
        self._last_ns = int(times_ns[-1])
        self.frames += len(times_ns)

    def close(self) -> None:
        """Finish the file and give it its name; again does nothing."""
        if not self._file.closed:
            self._file.close()
            self._part.replace(self.path)

    def __enter__(self) -> "PcapWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._file.close()

    def _block(self, times_ns: NDArray[np.int64], groups: Sequence[Group]) -> NDArray[np.uint8]:
        """Return the records as the bytes (total,) of the file."""
        sizes = np.empty(len(times_ns), np.int64)
        for places, frames in groups:
            sizes[places] = RECORD_HEADER.itemsize + frames.shape[1]
        ends = np.cumsum(sizes)
        block = np.empty(int(ends[-1]), np.uint8)
        for places, frames in groups:
            records = self._records(times_ns[places], frames)
            _copy(records, ends[places] - records.shape[1], block)
        return block

    def _records(self, times_ns: NDArray[np.int64], frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        n, size = frames.shape
        headers = np.empty(n, RECORD_HEADER)
        seconds, headers["fraction"] = np.divmod(times_ns, NS_PER_S)
        headers["seconds"] = seconds + self._epoch_s
        headers["captured_bytes"] = headers["bytes"] = size
        return np.hstack([headers.view(np.uint8).reshape(n, RECORD_HEADER.itemsize), frames])


@compiled
def _copy(rows: NDArray[np.uint8], starts: NDArray[np.int64], block: NDArray[np.uint8]) -> None:
    """Copy rows (n, size) to where each begins (n,) in a block."""
    size = rows.shape[1]
    for i in range(len(starts)):
        block[starts[i] : starts[i] + size] = rows[i]
