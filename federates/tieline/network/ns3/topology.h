// ns-3's nodes with their IPv4 stacks, point-to-point links, addresses and host routes.

#ifndef TIELINE_NS3_TOPOLOGY_H
#define TIELINE_NS3_TOPOLOGY_H

#include "link.h"

#include "ns3/internet-stack-helper.h"
#include "ns3/ipv4-l3-protocol.h"
#include "ns3/ipv4-static-routing-helper.h"
#include "ns3/ipv4-static-routing.h"
#include "ns3/node.h"
#include "ns3/object-factory.h"
#include "ns3/point-to-point-channel.h"
#include "ns3/point-to-point-net-device.h"
#include "ns3/uinteger.h"

namespace tieline
{

// The nodes of a network by number, and its ports: port 2l of link l, 2l + 1 back.
class Topology
{
  public:
    // Args: nodes, how many; pmu_flows, whose numbers come before those of the cross flows.
    Topology(int64_t nodes, int64_t pmu_flows)
        : m_ledger(pmu_flows)
    {
        ns3::ObjectFactory order;
        order.SetTypeId(TieOrder::GetTypeId());
        Simulator::SetScheduler(order);
        ns3::InternetStackHelper stack;
        stack.SetIpv6StackInstall(false);
        stack.SetRoutingHelper(ns3::Ipv4StaticRoutingHelper());
        for (int64_t number = 0; number < nodes; number++)
        {
            Ptr<ns3::Node> node = ns3::CreateObject<ns3::Node>();
            stack.Install(node);
            auto ip = node->GetObject<ns3::Ipv4L3Protocol>();
            ip->SetAttribute("DefaultTtl", ns3::UintegerValue(255));
            ip->TraceConnectWithoutContext("Drop", ns3::MakeCallback(&Topology::DroppedByIp, this));
            m_nodes.push_back(node);
        }
    }

    // The serialisation time that ns-3 finds, ns.
    static int64_t ServiceNs(uint64_t rate_bps, uint32_t bytes)
    {
        return ns3::DataRate(rate_bps).CalculateBytesTxTime(bytes).GetNanoSeconds();
    }

    // Return the number of a new supply of random numbers.
    int64_t AddSupply(size_t least)
    {
        m_supplies.emplace_back(least);
        return m_supplies.size() - 1;
    }

    void Fill(int64_t supply, const int64_t* values, size_t count)
    {
        m_supplies[supply].Add(values, count);
    }

    bool IsLow(int64_t supply) const
    {
        return m_supplies[supply].IsLow();
    }

    // Join two nodes; the port from a to b has an even number, the one back the next.
    // loss_there, loss_back: supplies of gaps between losses, in packets or in bits; -1: none.
    void AddLink(int64_t a,
                 int64_t b,
                 uint64_t rate_bps,
                 int64_t propagation_ns,
                 uint32_t queue_packets,
                 int64_t queue_bytes,
                 int64_t overhead_bytes,
                 int64_t loss_there,
                 int64_t loss_back,
                 bool is_per_bit)
    {
        auto channel = ns3::CreateObject<ns3::PointToPointChannel>();
        channel->SetAttribute("Delay", ns3::TimeValue(ns3::NanoSeconds(propagation_ns)));
        ns3::DataRate rate(rate_bps);
        for (int64_t node : {a, b})
        {
            auto device = ns3::CreateObject<ns3::PointToPointNetDevice>();
            auto fifo = ns3::CreateObject<LinkQueue>(m_ledger, rate, queue_bytes, overhead_bytes);
            fifo->SetMaxSize(ns3::QueueSize(ns3::PACKETS, queue_packets));
            device->SetDataRate(rate);
            device->SetMtu(65535); // nothing is fragmented
            device->SetQueue(fifo);
            device->Attach(channel);
            m_nodes[node]->AddDevice(device);
            m_ports.push_back({device, fifo, 0, LinkAddress(m_ports.size())});
            Address(m_ports.back(), m_nodes[node]);
        }
        Port& there = m_ports[m_ports.size() - 2];
        Port& back = m_ports[m_ports.size() - 1];
        Damage(back.device, there.queue, loss_there, is_per_bit);
        Damage(there.device, back.queue, loss_back, is_per_bit);
    }

    // Give a node the address of this number, besides those of its links.
    void AddAddress(int64_t node, uint32_t address)
    {
        auto ip = m_nodes[node]->GetObject<ns3::Ipv4>();
        ip->AddAddress(0, {HostAddress(address), ns3::Ipv4Mask::GetOnes()});
        Routes(m_nodes[node])->AddHostRouteTo(HostAddress(address), 0);
    }

    // Send what goes to an address out of a port of the node that the port belongs to.
    void AddRoute(uint32_t address, int64_t port)
    {
        const Port& own = m_ports[port];
        const Port& next = m_ports[port ^ 1];
        Routes(own.device->GetNode())
            ->AddHostRouteTo(HostAddress(address), next.address, own.interface);
    }

  protected:
    struct Port
    {
        Ptr<ns3::PointToPointNetDevice> device;
        Ptr<LinkQueue> queue;
        uint32_t interface;
        ns3::Ipv4Address address;
    };

    // 172.16.0.0/12 for flows, 10.0.0.0/8 in blocks of four for links.
    static ns3::Ipv4Address HostAddress(uint32_t number)
    {
        return ns3::Ipv4Address(0xAC100001 + number);
    }

    static ns3::Ipv4Address LinkAddress(uint32_t port)
    {
        return ns3::Ipv4Address(0x0A000001 + 4 * (port / 2) + port % 2);
    }

    Ledger m_ledger;
    std::vector<Ptr<ns3::Node>> m_nodes;
    std::vector<Port> m_ports;
    std::deque<Supply> m_supplies; // others keep pointers into it

  private:
    static void Address(Port& port, Ptr<ns3::Node> node)
    {
        auto ip = node->GetObject<ns3::Ipv4>();
        port.interface = ip->AddInterface(port.device);
        ip->AddAddress(port.interface, {port.address, ns3::Ipv4Mask(0xFFFFFFFC)});
        ip->SetUp(port.interface);
    }

    static Ptr<ns3::Ipv4StaticRouting> Routes(Ptr<ns3::Node> node)
    {
        auto protocol = node->GetObject<ns3::Ipv4>()->GetRoutingProtocol();
        return ns3::DynamicCast<ns3::Ipv4StaticRouting>(protocol);
    }

    void Damage(Ptr<ns3::PointToPointNetDevice> device,
                Ptr<LinkQueue> queue,
                int64_t gaps,
                bool is_per_bit)
    {
        if (gaps < 0 && queue->HasPpp())
        {
            return;
        }
        std::unique_ptr<Losses> losses;
        if (gaps >= 0)
        {
            losses = std::make_unique<Losses>(&m_supplies[gaps], is_per_bit);
        }
        device->SetReceiveErrorModel(
            ns3::CreateObject<LinkErrors>(m_ledger, queue, std::move(losses)));
    }

    void DroppedByIp(const ns3::Ipv4Header&,
                     Ptr<const ns3::Packet>,
                     ns3::Ipv4L3Protocol::DropReason reason,
                     Ptr<ns3::Ipv4>,
                     uint32_t)
    {
        m_ledger.Blame("IP dropped a packet for reason " + std::to_string(reason));
    }
};

} // namespace tieline

#endif
