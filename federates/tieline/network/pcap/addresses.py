"""The addresses that a network's nodes, PMUs, controllers and flows have in a capture.

    what                          IPv4                                    number n from
    router of a node              10.0.0.0/16,   address n + 1            0 to 65,534
    PMU                           10.1.0.0/16,   address n + 1            0 to 65,534
    controller                    10.2.0.0/16,   address n + 1            0 to 65,534
    sender of a cross flow        10.64.0.0/10,  address n + 1            0 to 4,194,302
    receiver of a cross flow      10.128.0.0/10, address n + 1            0 to 4,194,302
    group of a multicast stream   239.192.0.0/16, address n + 1           number of the PMU

n is the number in the `NetworkSpec`, so PMU 299 is 10.1.1.44. 10.0.0.0/8 is private (RFC 1918) and
239.192.0.0/14 is the organisation's own multicast scope (RFC 2365). A MAC address is 02:00 (locally
administered) and the four octets of the IPv4 address; a group's is 01:00:5e and the low 23 bits of
the group (RFC 1112), which differ for all groups above. A node has one MAC for all its links.

C37.118 data go over UDP from and to port 4713, or over TCP from port 4712 to 49152; cross traffic
goes from and to 49152, a port for which nothing is registered. 4712 and 4713 are the default ports
of IEEE Std C37.118.2, annex F.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tieline.errors import InputError
from tieline.network.spec import NetworkSpec

UDP, TCP = 17, 6
"""Numbers of the protocols over IPv4 (RFC 790)."""

C37118_UDP_PORT, C37118_TCP_PORT, DYNAMIC_PORT = 4713, 4712, 49152

FLOW_ADDRESS = np.dtype(
    [
        ("source_ip", "<u4"),
        ("target_ip", "<u4"),
        ("source_port", "<u2"),
        ("target_port", "<u2"),
        ("protocol", "u1"),
        ("dscp", "u1"),
        ("stream", "<i4"),
        ("payload_bytes", "<i4"),
        ("fragment_bytes", "<i4"),
    ]
)
"""What the headers of a flow's packets say.

`protocol` is `UDP` or `TCP`; `dscp` is 0 to 63; flows with one `stream` number are one conversation
(the branches of a multicast stream). `payload_bytes` are those after the UDP or TCP header; only
TCP and fragments need them. `fragment_bytes` are the bytes after the IPv4 header of each fragment
but the last, a multiple of 8, and 0 for a flow whose packets are never fragmented.
"""

_MOST_PAYLOAD = 0xFFFF - 20 - 8
_MOST_HOSTS = (1 << 16) - 1
_MOST_CROSS_FLOWS = (1 << 22) - 1
_NODE, _PMU, _CONTROLLER = (int(IPv4Address(f"10.{kind}.0.1")) for kind in range(3))
_SENDER, _RECEIVER = int(IPv4Address("10.64.0.1")), int(IPv4Address("10.128.0.1"))
_GROUP = int(IPv4Address("239.192.0.1"))
_FIRST_GROUP, _END_OF_GROUPS = int(IPv4Address("224.0.0.0")), int(IPv4Address("240.0.0.0"))
_LOCAL_MAC = 0x0200 << 32
_GROUP_MAC = 0x01005E << 24


@dataclass(frozen=True)
class AddressPlan:
    """IPv4 addresses as numbers, and what each flow's headers say.

    Attributes:
        nodes: (nodes,) uint32.
        sources: (sources,) uint32, of the PMUs.
        destinations: (destinations,) uint32, of the controllers.
        groups: (sources,) uint32, of the PMUs' multicast streams; (0,) where flows are unicast.
        flows: (flows,) of `FLOW_ADDRESS`: the PMU flows, then the cross flows. A caller may change
            a column, such as `dscp`, before a capture is opened.
        pmu_flows: how many of them are PMU flows.
    """

    nodes: NDArray[np.uint32]
    sources: NDArray[np.uint32]
    destinations: NDArray[np.uint32]
    groups: NDArray[np.uint32]
    flows: NDArray[np.void]
    pmu_flows: int

    def check(self) -> None:
        """Raise InputError if a caller wrote something into `flows` that no header can carry."""
        columns = {
            "protocol": (np.isin(self.flows["protocol"], (UDP, TCP)), f"{UDP} or {TCP}"),
            "dscp": (self.flows["dscp"] < 64, "0 to 63"),
            "payload_bytes": (
                (self.flows["payload_bytes"] >= 0) & (self.flows["payload_bytes"] <= _MOST_PAYLOAD),
                f"0 to {_MOST_PAYLOAD}",
            ),
            "fragment_bytes": (
                (self.flows["fragment_bytes"] >= 0) & (self.flows["fragment_bytes"] % 8 == 0),
                "a multiple of 8, or 0",
            ),
        }
        findings = [
            f"{name} of flow {flow} must be {allowed} (got {self.flows[name][flow]})"
            for name, (is_right, allowed) in columns.items()
            for flow in np.flatnonzero(~is_right)[:5]
        ]
        if findings:
            raise InputError(findings)


def address_plan(
    spec: NetworkSpec, payload_bytes: int, protocol: int = UDP, is_multicast: bool = False
) -> AddressPlan:
    """Return the addresses of a network, all flows best effort (DSCP 0) and not fragmented.

    Args:
        spec: the network.
        payload_bytes: of a PMU's data frame.
        protocol: `UDP` or `TCP`, of the PMU flows; cross flows are UDP.
        is_multicast: whether each PMU sends its frames to a group instead of to each controller.

    Raises:
        InputError: there are more nodes, PMUs, controllers or cross flows than addresses, or
            multicast was asked for over TCP.
    """
    _check_counts(spec)
    if is_multicast and protocol == TCP:
        raise InputError("a multicast stream needs UDP: TCP connects one sender and one receiver")
    sources = _addresses(_PMU, len(spec.sources))
    destinations = _addresses(_CONTROLLER, len(spec.destinations))
    pmu_flows = len(spec.flows)
    flows = np.zeros(pmu_flows + len(spec.cross_flows), FLOW_ADDRESS)
    flows["stream"] = np.arange(len(flows))
    source = np.array([flow.source for flow in spec.flows], dtype=np.int64)
    destination = np.array([flow.destination for flow in spec.flows], dtype=np.int64)
    of_pmus = flows[:pmu_flows]
    of_pmus["source_ip"] = sources[source]
    of_pmus["target_ip"] = destinations[destination]
    of_pmus["protocol"] = protocol
    of_pmus["source_port"] = C37118_TCP_PORT if protocol == TCP else C37118_UDP_PORT
    of_pmus["target_port"] = DYNAMIC_PORT if protocol == TCP else C37118_UDP_PORT
    of_pmus["payload_bytes"] = payload_bytes
    groups = _addresses(_GROUP, len(spec.sources) if is_multicast else 0)
    if is_multicast:
        of_pmus["target_ip"] = groups[source]
        _, first, which = np.unique(source, return_index=True, return_inverse=True)
        of_pmus["stream"] = first[which]
    _fill_cross(flows[pmu_flows:], spec)
    nodes = _addresses(_NODE, len(spec.nodes))
    return AddressPlan(nodes, sources, destinations, groups, flows, pmu_flows)


def mac_bytes(ips: ArrayLike) -> NDArray[np.uint8]:
    """Return the MAC addresses (n, 6) that belong to IPv4 addresses (n,), groups or not."""
    numbers = np.atleast_1d(np.asarray(ips, np.uint32)).astype(np.int64)
    is_group = (numbers >= _FIRST_GROUP) & (numbers < _END_OF_GROUPS)
    macs = np.where(is_group, _GROUP_MAC | numbers & 0x7FFFFF, _LOCAL_MAC | numbers)
    return macs.astype(">u8").view(np.uint8).reshape(-1, 8)[:, 2:]


def hosts_text(spec: NetworkSpec, plan: AddressPlan) -> str:
    """Return the names of all addresses as lines of a hosts file, for `wireshark -H FILE`."""
    cross = plan.flows[plan.pmu_flows :]
    lines = [*_lines(plan.nodes, spec.nodes), *_lines(plan.sources, spec.sources)]
    lines += _lines(plan.destinations, spec.destinations)
    lines += _lines(cross["source_ip"], spec.cross_flows, "from-")
    lines += _lines(cross["target_ip"], spec.cross_flows, "to-")
    if len(plan.groups):
        lines += _lines(plan.groups, spec.sources, "group-")
    return "".join(f"{line}\n" for line in lines)


def _fill_cross(flows: NDArray[np.void], spec: NetworkSpec) -> None:
    flows["source_ip"] = _addresses(_SENDER, len(flows))
    flows["target_ip"] = _addresses(_RECEIVER, len(flows))
    flows["source_port"] = flows["target_port"] = DYNAMIC_PORT
    flows["protocol"] = UDP
    flows["payload_bytes"] = [flow.traffic.payload_bytes for flow in spec.cross_flows]


def _addresses(first: int, count: int) -> NDArray[np.uint32]:
    return np.arange(first, first + count, dtype=np.uint32)


def _lines(ips: NDArray[np.uint32], things: Sequence[Any], before: str = "") -> list[str]:
    """Return a line for each thing; a blank would end its name."""
    return [
        f"{IPv4Address(int(ip))}\t{before}{'_'.join(thing.name.split())}"
        for ip, thing in zip(ips, things, strict=True)
    ]


def _check_counts(spec: NetworkSpec) -> None:
    findings = [
        f"a capture has addresses for {most} {what} at most (got {count})"
        for what, count, most in (
            ("nodes", len(spec.nodes), _MOST_HOSTS),
            ("PMUs", len(spec.sources), _MOST_HOSTS),
            ("controllers", len(spec.destinations), _MOST_HOSTS),
            ("cross flows", len(spec.cross_flows), _MOST_CROSS_FLOWS),
        )
        if count > most
    ]
    if findings:
        raise InputError(findings)
