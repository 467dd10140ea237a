"""A wide-area network, packet by packet, against ns-3."""

from pathlib import Path

import numpy as np

from network.builders import ALL, overhead_for
from tieline.network.packet import PacketEngine
from tieline.network.queues import DropTail
from tieline.network.spec import CrossFlow, Destination, Flow, Link, NetworkSpec, Node, Source
from tieline.network.traffic import Trace

DATA = Path(__file__).parent / "data" / "wan_base_extract.npz"
PMUS, CONTROLLERS = 30, 34
# ns-3's frames are 76 bytes of payload and 2 of PPP; ours are 34, so the link layer adds the rest,
# and the payload of the cross traffic makes up for it.
OVERHEAD = overhead_for(76 + 28 + 2)


def wide_area_network() -> NetworkSpec:
    """Return the network of the extract."""
    data = np.load(DATA)
    links = tuple(
        Link(f"n{a}", f"n{b}", rate, propagation, DropTail(queue), overhead_bytes=OVERHEAD)
        for a, b, rate, propagation, queue in data["links"].tolist()
    )
    ends = np.cumsum(data["route_lengths"].astype(int))[:-1]
    routes = [
        tuple(f"n{node}" for node in route) for route in np.split(data["routes"].tolist(), ends)
    ]
    flows = tuple(
        Flow(i, j, routes[i * CONTROLLERS + j]) for i in range(PMUS) for j in range(CONTROLLERS)
    )
    sources = tuple(
        Source(f"p{i}", i, routes[i * CONTROLLERS][0], offset)
        for i, offset in enumerate(data["offsets_ns"].tolist())
    )
    destinations = tuple(
        Destination(f"c{j}", f"G{j}", j, routes[j][-1]) for j in range(CONTROLLERS)
    )
    payload = int(data["cross_payload_bytes"]) + 2 - OVERHEAD
    traces = np.split(data["trace_ns"], np.cumsum(data["trace_lengths"])[:-1])
    cross = tuple(
        CrossFlow(f"cross flow {c}", Trace(times_ns, np.full(len(times_ns), payload)), route)
        for c, (times_ns, route) in enumerate(
            zip(traces, routes[PMUS * CONTROLLERS :], strict=True)
        )
    )
    nodes = tuple(Node(name) for name in sorted({name for route in routes for name in route}))
    return NetworkSpec(nodes, links, sources, destinations, flows, cross)


def test_every_packet_takes_as_long_as_in_ns3():
    """Otherwise the engine would not be the network that it claims to be.

    90 frames of 30 PMUs to 34 controllers over 40 routers with cross traffic: 91,800 packets, each
    delay to the nanosecond and the same 219 drops. Frames after the 90th are sent, too, since they
    can still delay those before.
    """
    engine = PacketEngine(wide_area_network(), seed=1)
    for k in range(96):
        engine.send(k * 10**9 // 60, np.arange(PMUS), k)
    arrivals = engine.run_until(ALL).arrivals
    data = np.load(DATA)
    expected = np.where(data["excess_ns"] < 0, -1, data["least_ns"][:, None] + data["excess_ns"])
    arrivals = arrivals[arrivals["sequence"] < 90]
    sent_ns = arrivals["sequence"].astype(np.int64) * 10**9 // 60
    sent_ns += data["offsets_ns"][arrivals["source"]]
    delays_ns = np.full(expected.shape, -1)
    flows = arrivals["source"].astype(int) * CONTROLLERS + arrivals["destination"]
    delays_ns[flows, arrivals["sequence"]] = arrivals["arrival_ns"] - sent_ns
    assert np.array_equal(delays_ns, expected)
    assert np.count_nonzero(expected < 0) == 219
