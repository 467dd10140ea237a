"""A tapped link that several tests share: records as a network hands them over, and its frames."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from network.builders import busy_ring
from tieline.c37118.batch import encode_frames
from tieline.network.pcap import TAP, TCP, AddressPlan, Capture, stream_configurations
from tieline.network.spec import service_ns
from tieline.units import tick_ns

EPOCH_S = 1_700_000_000
RATE_HZ = 60
FRAMES = 30
SPEC = busy_ring()
IDCODES = (7, 65_000)
LINK = 2
"""From c to d: PMU flows 3 and 5 one way (hop 0), cross flows 6 (hop 1) and 7 (hop 0) back."""


def measured(frames: int = FRAMES) -> NDArray[np.uint8]:
    """Return the frames (frames, 2, 34) of two PMUs, no two alike."""
    rows = []
    for k in range(frames):
        f_hz = np.array([60.0 + k / 64, 59.5 - k / 128])
        phasors = np.array([1000.0 + 2 * k + 250j, -400.5 + (k + 1) * 1j])
        rocof = np.array([k / 8, -k / 4])
        time_ns = tick_ns(k, RATE_HZ)
        rows.append(encode_frames(IDCODES, time_ns, phasors, f_hz, rocof, epoch_s=EPOCH_S))
    return np.stack(rows)


MEASURED = measured()


def payload_of(sources: NDArray[np.int64], sequences: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the frames of sources with sequence numbers."""
    return MEASURED[sequences, sources]


def tapped(plan: AddressPlan) -> NDArray[np.void]:
    """Return the records of every packet that would cross the link if no other link delayed it.

    Each direction sends one packet after the other; the records stand flow by flow.
    """
    routes = [flow.route for flow in (*SPEC.flows, *SPEC.cross_flows)]
    crossing = [
        (flow, hop, SPEC.ports[pair])
        for flow, route in enumerate(routes)
        for hop, pair in enumerate(pairwise(route))
        if SPEC.ports[pair] // 2 == LINK
    ]
    packets = []
    for flow, hop, port in crossing:
        for k in range(FRAMES):
            ready_ns = tick_ns(k, RATE_HZ) + 3_000_000 * hop
            packets += [
                (ready_ns, port, flow, k, hop, part, size, 0)
                for part, size in enumerate(_parts(plan.flows[flow]))
            ]
    records = np.array(packets, TAP)
    for port in (2 * LINK, 2 * LINK + 1):
        free_ns = 0
        own = np.flatnonzero(records["port"] == port)
        for place in own[np.argsort(records["sent_ns"][own], kind="stable")]:
            sent_ns = max(free_ns, int(records["sent_ns"][place]))
            records["sent_ns"][place] = sent_ns
            payload_bytes = int(records["bytes"][place]) - 28
            free_ns = sent_ns + service_ns(SPEC.links[LINK], payload_bytes)
    return records


def captured(path: Path, plan: AddressPlan, records: NDArray[np.void], step_ns: int) -> None:
    """Write a capture of the link as a network that goes on by steps hands it over."""
    configurations = stream_configurations(SPEC, IDCODES, 60, RATE_HZ, EPOCH_S)
    capture = Capture(path, SPEC, plan, LINK, configurations, EPOCH_S)
    end_ns = int(records["sent_ns"].max()) + 1
    known_ns = records["sent_ns"] - np.arange(len(records)) % 7 * 1_000_000
    for until_ns in range(step_ns, end_ns + step_ns, step_ns):
        is_new = (known_ns < until_ns) & (known_ns >= until_ns - step_ns)
        is_new |= (until_ns == step_ns) & (known_ns < 0)
        capture.add(records[is_new], payload_of, until_ns)
    capture.close()


def _parts(flow: np.void) -> list[int]:
    """Return the IP bytes of each fragment of one packet, or of the packet itself."""
    whole = int(flow["payload_bytes"]) + (20 if flow["protocol"] == TCP else 8)
    most = int(flow["fragment_bytes"]) or whole
    return [20 + min(most, whole - first) for first in range(0, whole, most)]
