"""Bulk transfers by ns-3's TcpNewReno: `python ns3_tcp.py RESULT` writes what each one got.

A process of its own, because ns-3's compiler must be loaded before HELICS, which other tests bring.
Options that the greedy connection leaves out are off: selective and delayed acknowledgements,
limited transmit, timestamps. Its first window, least retransmission time and segments are set in
ns-3.
"""

import json
import sys
from importlib.util import find_spec
from pathlib import Path

from tieline.network.packet.build import LEAST_WAIT_NS

CASES = {
    "a full link": (10_000_000, 10_000_000, 60, 0.0),
    "one packet lost in a thousand": (100_000_000, 20_000_000, 2000, 0.001),
    "one packet lost in a hundred": (100_000_000, 20_000_000, 2000, 0.01),
    "one packet lost in thirty": (100_000_000, 20_000_000, 2000, 1 / 30),
    "losses on a full link": (5_000_000, 30_000_000, 20, 0.002),
}
"""Of each transfer: rate of the link in bit/s, its propagation in ns, packets that wait, loss."""

RUNS, FROM_S, TO_S = 4, 20, 120
SEGMENT_BYTES, WINDOW = 1448, 1000

SOURCE = """
#include "ns3/applications-module.h"
#include "ns3/core-module.h"
#include "ns3/internet-module.h"
#include "ns3/network-module.h"
#include "ns3/point-to-point-module.h"
#include "ns3/traffic-control-module.h"

using namespace ns3;

struct Bulk
{
    static void SetUp(int segment, int window, int64_t leastWaitNs)
    {
        Config::SetDefault("ns3::TcpL4Protocol::SocketType",
                           TypeIdValue(TypeId::LookupByName("ns3::TcpNewReno")));
        Config::SetDefault("ns3::TcpSocketBase::Sack", BooleanValue(false));
        Config::SetDefault("ns3::TcpSocketBase::Timestamp", BooleanValue(false));
        Config::SetDefault("ns3::TcpSocketBase::LimitedTransmit", BooleanValue(false));
        Config::SetDefault("ns3::TcpSocketBase::MinRto", TimeValue(NanoSeconds(leastWaitNs)));
        Config::SetDefault("ns3::TcpSocket::DelAckCount", UintegerValue(1));
        Config::SetDefault("ns3::TcpSocket::InitialCwnd", UintegerValue(10));
        Config::SetDefault("ns3::TcpSocket::SegmentSize", UintegerValue(segment));
        Config::SetDefault("ns3::TcpSocket::SndBufSize", UintegerValue(segment * window));
        Config::SetDefault("ns3::TcpSocket::RcvBufSize", UintegerValue(segment * window));
    }

    static double RateBps(int64_t rate, int64_t delayNs, int queue, double loss, int run,
                          double from, double to)
    {
        RngSeedManager::SetRun(run);
        NodeContainer nodes(2);
        PointToPointHelper link;
        link.SetDeviceAttribute("DataRate", DataRateValue(DataRate(rate)));
        link.SetChannelAttribute("Delay", TimeValue(NanoSeconds(delayNs)));
        link.SetQueue("ns3::DropTailQueue<Packet>", "MaxSize",
                      QueueSizeValue(QueueSize(QueueSizeUnit::PACKETS, queue)));
        NetDeviceContainer devices = link.Install(nodes);
        InternetStackHelper().Install(nodes);
        Ipv4AddressHelper addresses("10.0.0.0", "255.255.255.0");
        Ipv4InterfaceContainer interfaces = addresses.Assign(devices);
        TrafficControlHelper().Uninstall(devices);
        for (int i = 0; i < 2 && loss > 0; i++)
        {
            Ptr<RateErrorModel> errors = CreateObject<RateErrorModel>();
            errors->SetUnit(RateErrorModel::ERROR_UNIT_PACKET);
            errors->SetRate(loss);
            errors->AssignStreams(2 * run + i);
            DynamicCast<PointToPointNetDevice>(devices.Get(i))->SetReceiveErrorModel(errors);
        }
        InetSocketAddress target(interfaces.GetAddress(1), 5000);
        PacketSinkHelper sinks("ns3::TcpSocketFactory", target);
        Ptr<PacketSink> sink = DynamicCast<PacketSink>(sinks.Install(nodes.Get(1)).Get(0));
        BulkSendHelper sources("ns3::TcpSocketFactory", target);
        sources.Install(nodes.Get(0));
        Simulator::Stop(Seconds(from));
        Simulator::Run();
        uint64_t before = sink->GetTotalRx();
        Simulator::Stop(Seconds(to - from));
        Simulator::Run();
        uint64_t received = sink->GetTotalRx() - before;
        Simulator::Destroy();
        return 8.0 * received / (to - from);
    }
};
"""


def bulk() -> object:
    """Return the compiled class, with the libraries of ns-3 that it needs."""
    import cppyy

    found = find_spec("ns3")
    assert found is not None
    [folder] = [Path(place) for place in found.submodule_search_locations]
    cppyy.add_include_path(str(folder / "include"))
    modules = ("core", "network", "stats", "traffic-control", "internet", "point-to-point")
    for module in (*modules, "applications"):
        [library] = folder.glob(f"lib*/libns3*-{module}.so")
        cppyy.load_library(str(library))
    cppyy.cppdef(SOURCE)
    return cppyy.gbl.Bulk


if __name__ == "__main__":
    transfers = bulk()
    transfers.SetUp(SEGMENT_BYTES, WINDOW, LEAST_WAIT_NS)
    rates_bps = {
        name: [transfers.RateBps(*case, run, FROM_S, TO_S) for run in range(1, RUNS + 1)]
        for name, case in CASES.items()
    }
    Path(sys.argv[1]).write_text(json.dumps(rates_bps), encoding="utf-8")
