"""Captures of links for Wireshark, and recorded traffic for replay."""

from tieline.network.engine import TAP
from tieline.network.pcap.addresses import (
    FLOW_ADDRESS,
    TCP,
    UDP,
    AddressPlan,
    address_plan,
    hosts_text,
)
from tieline.network.pcap.capture import Capture, stream_configurations
from tieline.network.pcap.reader import PacketTrace, read_pcap
from tieline.network.pcap.writer import PcapWriter

__all__ = [
    "FLOW_ADDRESS",
    "TAP",
    "TCP",
    "UDP",
    "AddressPlan",
    "Capture",
    "PacketTrace",
    "PcapWriter",
    "address_plan",
    "hosts_text",
    "read_pcap",
    "stream_configurations",
]
