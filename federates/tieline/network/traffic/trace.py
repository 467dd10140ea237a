"""Traffic as it was recorded: the times and sizes of datagrams, from a CSV or a capture file."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from tieline.errors import InputError
from tieline.network.draws import NEVER, Chunks, chunked
from tieline.network.entry import named_file
from tieline.network.traffic.base import HEADER_BYTES, MOST_PAYLOAD, FlowEntry, Traffic
from tieline.units import NS_PER_S, seconds_to_ns

COLUMNS = ("time_s", "payload_bytes")
CAPTURES = (".pcap", ".cap")
"""Endings of capture files; any other file is taken for a CSV."""


@dataclass(frozen=True, eq=False)
class Trace:
    """Datagrams at given instants, then silence.

    Attributes:
        times_ns: (n,) instants, ascending, counted from the flow's start.
        payloads: (n,) payload of each, bytes.
    """

    times_ns: NDArray[np.int64]
    payloads: NDArray[np.int64]

    @property
    def payload_bytes(self) -> int:
        """The largest payload."""
        return int(self.payloads.max(initial=1))

    @property
    def rate_bps(self) -> float:
        """The mean rate from the first datagram to the last."""
        span_ns = int(self.times_ns[-1] - self.times_ns[0]) if len(self.times_ns) > 1 else 0
        if span_ns == 0:
            return math.nan
        return float((self.payloads[:-1] + HEADER_BYTES).sum()) * 8 * NS_PER_S / span_ns

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps."""
        return chunked([np.diff(self.times_ns, prepend=0)], NEVER)

    def sizes(self) -> Chunks:
        """Yield the payloads."""
        return chunked([self.payloads], 1)

    def scaled(self, factor: float) -> Traffic:
        """Return it as it is: a record has the rate that it has."""
        return self


def read_trace(path: Path) -> Trace:
    """Return the trace of a CSV file with the columns `time_s` and `payload_bytes`.

    Raises:
        ValueError: there is no such file, a column or value is missing or no number within bounds,
            or a time is before the last one.
    """
    times: list[int] = []
    payloads: list[int] = []
    try:
        with path.open(newline="", encoding="utf-8") as lines:
            rows = csv.DictReader(lines)
            missing = [name for name in COLUMNS if name not in (rows.fieldnames or ())]
            if missing:
                raise ValueError(f"{path}:1: no column '{missing[0]}' (has {rows.fieldnames})")
            for row in rows:
                where = f"{path}:{rows.line_num}"
                times.append(seconds_to_ns(_number(where, row, "time_s", 0.0, 1e9)))
                payloads.append(_whole(where, row, "payload_bytes", 1, MOST_PAYLOAD))
                if times[-1] < max(times[-2:]):
                    raise ValueError(
                        f"{where}: 'time_s' must not be before the line above "
                        f"({row['time_s']} s after {times[-2] / NS_PER_S:g} s)"
                    )
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"cannot read {path}: {error}") from error
    return Trace(np.array(times, dtype=np.int64), np.array(payloads, dtype=np.int64))


def _number(where: str, row: dict[str, str], name: str, low: float, high: float) -> float:
    try:
        value = float(row[name])
    except (TypeError, ValueError):
        value = math.nan
    if not low <= value <= high:
        raise ValueError(
            f"{where}: '{name}' must be >= {low:g} and <= {high:g} (got {row[name]!r})"
        )
    return value


def _whole(where: str, row: dict[str, str], name: str, low: int, high: int) -> int:
    value = _number(where, row, name, low, high)
    if not value.is_integer():
        raise ValueError(f"{where}: '{name}' must be a whole number (got {row[name]!r})")
    return int(value)


def replayed(path: Path) -> Trace:
    """Return the packets of a capture file, each as a datagram of its size.

    Raises:
        ValueError: the file is no capture that can be read.
    """
    # Captures know the network, and the network its kinds of traffic.
    from tieline.network.pcap import read_pcap

    try:
        recorded = read_pcap(path)
    except InputError as error:
        raise ValueError(str(error)) from error
    payloads = np.clip(recorded.sizes_bytes - HEADER_BYTES, 1, MOST_PAYLOAD)
    return Trace(recorded.times_ns, payloads)


def _trace_of(value: Any, info: ValidationInfo) -> Trace:
    path = named_file(value, info)
    return replayed(path) if path.suffix in CAPTURES else read_trace(path)


class TraceEntry(FlowEntry):
    """Recorded traffic."""

    kind: Literal["trace"] = Field(description="which traffic this is")
    file: Annotated[Trace, BeforeValidator(_trace_of), WithJsonSchema({"type": "string"})] = Field(
        description="CSV or pcap file, relative to the topology file"
    )

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return self.file
