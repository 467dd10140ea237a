"""What a link carries, as a pcap file that Wireshark opens: both directions, in order of time.

A frame's time is when its first bit goes on the link. It stands in the file even if the link then
loses it; a packet that a full queue dropped does not. Every packet is an Ethernet frame, whatever
link layer the simulated link has, without preamble, padding and frame check.

PMU flows carry the bytes of their IEEE C37.118 frames, cross traffic zeros. A node is a router;
PMUs, controllers and the ends of cross flows are hosts behind it, so a packet sent with TTL 255
has 254 - h on its hop h = 0, 1, ... The IPv4 identification is the packet's sequence number.

One thing is added that the simulated link does not carry: before the first frame of each stream, at
the same time, stands its configuration frame CFG-2. Wireshark shows the values of data frames only
after a CFG-2 of the same conversation; `synphasor.frtype != 3` filters it out again.

TCP here is the flow's own segments alone: the first byte of segment k has the sequence number
1 + k payload_bytes. Connections are not opened or closed, and nothing is acknowledged.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.c37118.batch import stream_config
from tieline.errors import CosimError, InputError
from tieline.network.engine import TAP
from tieline.network.pcap.addresses import AddressPlan
from tieline.network.pcap.frames import LinkFrames, PayloadOf
from tieline.network.pcap.writer import Group, PcapWriter
from tieline.network.spec import NetworkSpec

_BLOCK = 16_384
_STATION_CHARACTERS = 16


def stream_configurations(
    spec: NetworkSpec, idcodes: Sequence[int], f0_hz: int, rate_hz: int, epoch_s: int = 0
) -> list[bytes]:
    """Return the CFG-2 frame of each source's stream of 34-byte frames.

    Args:
        spec: the network; a PMU's station name is its own, cut to 16 characters.
        idcodes: (sources,) numbers of the streams.
        f0_hz: nominal frequency, 50 or 60.
        rate_hz: frames a second.
        epoch_s: SOC of the start of the run, s.

    Raises:
        InputError: there is not one number for each source.
        FrameError: a number or a name cannot stand in a frame.
    """
    if len(idcodes) != len(spec.sources):
        raise InputError(f"{len(spec.sources)} PMUs need as many idcodes (got {len(idcodes)})")
    return [
        stream_config(
            int(idcode), source.name[:_STATION_CHARACTERS], f0_hz, rate_hz, epoch_s
        ).to_bytes()
        for source, idcode in zip(spec.sources, idcodes, strict=True)
    ]


class Capture:
    """The capture file of one link.

    Args:
        path: the file to make; it appears whole at `close`.
        spec: the network.
        plan: its addresses.
        link: number of the link in `spec.links`; its ports are 2 link and 2 link + 1.
        configurations: the CFG-2 frame of each source.
        epoch_s: SOC of the start of the run, s since 1970-01-01 UTC, as the PMUs have it.

    Raises:
        InputError: the link is not there, a source has no configuration, the plan holds what no
            header can carry, or `epoch_s` does not fit a pcap file.
    """

    def __init__(
        self,
        path: Path,
        spec: NetworkSpec,
        plan: AddressPlan,
        link: int,
        configurations: Sequence[bytes],
        epoch_s: int = 0,
    ) -> None:
        if len(configurations) != len(spec.sources):
            raise InputError(
                f"a capture of {len(spec.sources)} PMUs needs a CFG-2 frame of each "
                f"(got {len(configurations)})"
            )
        self._frames = LinkFrames(spec, plan, link)
        self._configurations = [
            np.frombuffer(configurations[flow.source], np.uint8) for flow in spec.flows
        ]
        # Cross flows need no configuration, so theirs counts as written.
        self._stream_of = plan.flows["stream"]
        self._is_configured = np.arange(len(plan.flows)) >= plan.pmu_flows
        self._held = np.empty(0, TAP)
        self._until_ns = 0
        self._writer = PcapWriter(path, epoch_s)

    def add(self, records: NDArray[np.void], payload_of: PayloadOf, until_ns: int) -> None:
        """Write what went on the link before an instant.

        Args:
            records: (n,) of `TAP`, of both directions in any order: every packet of the link that
                was given its `sent_ns` since the last call. Those that go on the link at `until_ns`
                or later, after a wait in the queue, are held back.
            payload_of: asked for the PMU frames that are written now; it must know the frame of
                every packet that had not ended at the last call's `until_ns`.
            until_ns: instant up to which the network has run.

        Raises:
            CosimError: the instant or a packet is before one already written, a record is of
                another link, or a packet's bytes do not fit its flow.
        """
        self._frames.check(records)
        earliest_ns = int(records["sent_ns"].min(initial=until_ns))
        if earliest_ns < self._until_ns:
            raise CosimError(
                f"{self._writer.path.name} is written up to {self._until_ns} ns: a packet or a "
                f"step of {earliest_ns} ns comes too late"
            )
        self._until_ns = until_ns
        waiting = np.concatenate([self._held, records])
        is_due = waiting["sent_ns"] < until_ns
        self._held = waiting[~is_due]
        due = waiting[is_due]
        due = due[np.lexsort((due["port"], due["sent_ns"]))]
        for first in range(0, len(due), _BLOCK):
            self._write(due[first : first + _BLOCK], payload_of)

    def close(self) -> None:
        """Finish the file; packets that still wait for the link are not in it."""
        self._writer.close()

    def _write(self, records: NDArray[np.void], payload_of: PayloadOf) -> None:
        openers = self._openers(records)
        is_opener = np.zeros(len(records), np.int64)
        is_opener[openers] = 1
        places = np.arange(len(records)) + np.cumsum(is_opener)
        times_ns = np.empty(len(records) + len(openers), np.int64)
        times_ns[places] = records["sent_ns"]
        times_ns[places[openers] - 1] = records["sent_ns"][openers]
        groups = [
            Group(places[own], frames) for own, frames in self._frames.data(records, payload_of)
        ]
        for own, frames in self._announced(records[openers]):
            groups.append(Group(places[openers[own]] - 1, frames))
        self._writer.write(times_ns, groups)

    def _openers(self, records: NDArray[np.void]) -> NDArray[np.int64]:
        """Return the places of the first packet of each stream that has none in the file yet."""
        streams = self._stream_of[records["flow"]]
        fresh = np.flatnonzero(~self._is_configured[streams])
        opened, first = np.unique(streams[fresh], return_index=True)
        self._is_configured[opened] = True
        return np.sort(fresh[first])

    def _announced(self, openers: NDArray[np.void]) -> Iterator[Group]:
        """Yield the configuration frames that come before some packets, size by size."""
        own = [self._configurations[flow] for flow in openers["flow"]]
        sizes = np.array([len(config) for config in own], dtype=np.int64)
        for size in np.unique(sizes):
            places = np.flatnonzero(sizes == size)
            payload = np.stack([own[place] for place in places])
            for group in self._frames.ahead(openers[places], payload):
                yield Group(places[group.places], group.frames)
