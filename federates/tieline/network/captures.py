"""Writes what chosen links carry as capture files, as a run goes."""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tieline.network.packet import PacketEngine
from tieline.network.pcap import (
    TCP,
    UDP,
    Capture,
    address_plan,
    hosts_text,
    stream_configurations,
)
from tieline.network.spec import FRAME_BYTES, Link, NetworkSpec

PayloadOf = Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.uint8]]


_NO_NAME = re.compile(r"[^A-Za-z0-9_.+-]")
"""What no file's name holds: a node may be called anything, also `../x`."""


def capture_names(links: Sequence[Link], taps: Iterable[int]) -> dict[int, str]:
    """Return the file `A-B.pcap` of each tapped link, by the link's number; no two are alike."""
    names: dict[int, str] = {}
    for number in taps:
        ends = (_NO_NAME.sub("_", node) for node in (links[number].a, links[number].b))
        name = "-".join(ends).lstrip(".")
        is_free = f"{name}.pcap" not in names.values()
        names[number] = f"{name}.pcap" if is_free else f"{name}.{number}.pcap"
    return names


class Captures:
    """The capture files of a run, `A-B.pcap` for each link that is listened to, and `hosts`.

    Args:
        folder: where the files go.
        spec: the network, with its taps.
        engine: what carries the packets.
        f0_hz, rate_hz: nominal frequency and frames a second, for the configuration frames.

    Raises:
        InputError: the network has more nodes or flows than addresses.
    """

    def __init__(
        self, folder: Path, spec: NetworkSpec, engine: PacketEngine, f0_hz: int, rate_hz: int
    ) -> None:
        self._engine = engine
        if not spec.taps:
            self._captures: dict[int, Capture] = {}
            return
        protocol = TCP if spec.transport == "tcp" else UDP
        plan = address_plan(spec, FRAME_BYTES, protocol, spec.transport == "multicast")
        plan.flows["dscp"][: len(spec.flows)] = spec.dscp
        plan.flows["dscp"][len(spec.flows) :] = [flow.dscp for flow in spec.cross_flows]
        plan.flows["fragment_bytes"] = engine.fragment_bytes
        numbers = range(1, len(spec.sources) + 1)
        configurations = stream_configurations(spec, numbers, f0_hz, rate_hz)
        (folder / "hosts").write_text(hosts_text(spec, plan), encoding="utf-8")
        self._captures = {}
        for number, name in capture_names(spec.links, spec.taps).items():
            path = folder / name
            self._captures[number] = Capture(path, spec, plan, number, configurations)

    def add(self, until_ns: int, payload_of: PayloadOf) -> None:
        """Write what has gone on the links up to an instant.

        Args:
            until_ns: the instant that the engine has reached.
            payload_of: returns the frames (n, size) of sources and sequence numbers (n,); it must
                still know every frame that had not ended when this was last called.
        """
        if not self._captures:
            return
        records = self._engine.tapped()
        for link, capture in self._captures.items():
            capture.add(records[records["port"] // 2 == link], payload_of, until_ns)

    def close(self) -> None:
        """Finish the files."""
        for capture in self._captures.values():
            capture.close()
