"""The address plan: documented, distinct, and large enough."""

from ipaddress import IPv4Address

import numpy as np
import pytest

from network.builders import busy_ring
from tieline.errors import InputError
from tieline.network.pcap import FLOW_ADDRESS, TCP, address_plan, hosts_text
from tieline.network.pcap.addresses import mac_bytes
from tieline.network.spec import Destination, Flow, NetworkSpec, Node, Source


def large(sources: int, destinations: int, nodes: int = 1) -> NetworkSpec:
    """Return a network with one flow for each PMU."""
    return NetworkSpec(
        tuple(Node(f"n{i}") for i in range(nodes)),
        (),
        tuple(Source(f"p{i}", i, "n0") for i in range(sources)),
        tuple(Destination(f"c{i}", f"G{i}", i, "n0") for i in range(destinations)),
        tuple(Flow(i, i % destinations, ("n0",)) for i in range(sources)),
    )


def text(mac: np.ndarray) -> str:
    return mac.tobytes().hex(":")


def test_addresses_are_those_of_the_documented_plan():
    """A user looks an address up by hand; results of two versions are compared by address."""
    plan = address_plan(large(300, 2, 10_000), 34, is_multicast=True)
    assert str(IPv4Address(int(plan.nodes[9_999]))) == "10.0.39.16"
    assert str(IPv4Address(int(plan.sources[299]))) == "10.1.1.44"
    assert str(IPv4Address(int(plan.destinations[1]))) == "10.2.0.2"
    assert str(IPv4Address(int(plan.groups[299]))) == "239.192.1.44"
    assert text(mac_bytes(plan.sources[299])) == "02:00:0a:01:01:2c"
    assert text(mac_bytes(plan.groups[299])) == "01:00:5e:40:01:2c"


@pytest.mark.parametrize("is_multicast", [False, True])
def test_the_largest_network_has_distinct_addresses(is_multicast: bool):
    """Two devices with one address would be one device to whoever reads the capture."""
    plan = address_plan(large(65_535, 65_535, 65_535), 34, is_multicast=is_multicast)
    groups = plan.groups if is_multicast else plan.nodes[:0]
    ips = np.concatenate([plan.nodes, plan.sources, plan.destinations, groups])
    assert len(np.unique(ips)) == len(ips)
    assert len(np.unique(mac_bytes(ips), axis=0)) == len(ips)


def test_one_more_than_the_plan_holds_is_refused_by_name():
    """Silent reuse of addresses would merge two PMUs."""
    with pytest.raises(InputError, match=r"65535 PMUs at most \(got 65536\)"):
        address_plan(large(65_536, 1), 34)


@pytest.mark.parametrize("protocol", [17, TCP])
def test_every_flow_is_a_conversation_of_its_own(protocol: int):
    """Wireshark would show one flow's values with the configuration of another."""
    plan = address_plan(busy_ring(), 34, protocol)
    sockets = [name for name in FLOW_ADDRESS.names if name[-2:] in ("ip", "rt", "ol")]
    tuples = {tuple(flow[sockets].tolist()) for flow in plan.flows}
    assert len(tuples) == len(plan.flows) == 8
    assert list(plan.flows["stream"]) == list(range(8))
    ports = {17: (4713, 4713), TCP: (4712, 49152)}[protocol]
    assert {(int(f["source_port"]), int(f["target_port"])) for f in plan.flows[:6]} == {ports}


def test_branches_of_a_multicast_stream_are_one_conversation():
    """A PMU that multicasts sends one stream, to one group, whoever listens."""
    plan = address_plan(busy_ring(), 34, is_multicast=True)
    assert list(plan.flows["stream"]) == [0, 0, 0, 3, 3, 3, 6, 7]
    assert list(plan.flows["target_ip"][:6]) == list(np.repeat(plan.groups, 3))
    with pytest.raises(InputError, match="multicast stream needs UDP"):
        address_plan(busy_ring(), 34, TCP, is_multicast=True)


def test_the_hosts_file_names_every_address():
    """Wireshark should show names where its user asks for them."""
    spec = busy_ring()
    lines = hosts_text(spec, address_plan(spec, 34, is_multicast=True)).splitlines()
    names = dict(line.split("\t") for line in lines)
    assert len(lines) == len(names) == 4 + 2 + 3 + 2 * 2 + 2
    assert (names["10.0.0.1"], names["10.1.0.2"], names["10.2.0.3"]) == ("a", "p1", "c2")
    assert (names["10.64.0.1"], names["10.128.0.2"]) == ("from-poisson", "to-cbr")
    assert names["239.192.0.2"] == "group-p1"


@pytest.mark.parametrize(
    ("column", "value", "allowed"),
    [
        ("protocol", 1, "17 or 6"),
        ("dscp", 64, "0 to 63"),
        ("payload_bytes", 65_508, "0 to 65507"),
        ("fragment_bytes", 20, "a multiple of 8, or 0"),
    ],
)
def test_a_column_that_no_header_can_carry_is_refused(column: str, value: int, allowed: str):
    """NumPy would cut the number to the width of the field."""
    plan = address_plan(busy_ring(), 34)
    plan.check()
    plan.flows[column][3] = value
    with pytest.raises(InputError, match=rf"{column} of flow 3 must be {allowed} \(got {value}\)"):
        plan.check()
