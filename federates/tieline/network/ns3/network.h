// A whole network of ns-3 nodes, links, routes and sockets, with the flows that use it.

#ifndef TIELINE_NS3_NETWORK_H
#define TIELINE_NS3_NETWORK_H

#include "model.h"

namespace tieline
{

class Network
{
  public:
    static constexpr uint16_t FIRST_PORT = 10000;
    static constexpr uint16_t DISCARD_PORT = 9;
    static constexpr int64_t CROSS = -1;

    // Args: nodes, how many; pmu_flows, whose numbers come before those of the cross flows.
    Network(int64_t nodes, int64_t pmu_flows)
        : m_ledger(pmu_flows)
    {
        s_is_open = true;
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
            ip->TraceConnectWithoutContext("Drop", ns3::MakeCallback(&Network::DroppedByIp, this));
            m_nodes.push_back(node);
        }
    }

    // It takes everything with it that ns-3 holds in this process.
    ~Network()
    {
        Simulator::Destroy();
        s_is_open = false;
    }

    // ns-3 has one simulator, so a process can hold one network at a time.
    static bool IsOpen()
    {
        return s_is_open;
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
    // loss_there, loss_back: supplies of losses, or -1 for none.
    void AddLink(int64_t a,
                 int64_t b,
                 uint64_t rate_bps,
                 int64_t propagation_ns,
                 uint32_t queue,
                 int64_t overhead_bytes,
                 int64_t loss_there,
                 int64_t loss_back)
    {
        auto channel = ns3::CreateObject<ns3::PointToPointChannel>();
        channel->SetAttribute("Delay", ns3::TimeValue(ns3::NanoSeconds(propagation_ns)));
        ns3::DataRate rate(rate_bps);
        for (int64_t node : {a, b})
        {
            auto device = ns3::CreateObject<ns3::PointToPointNetDevice>();
            auto fifo = ns3::CreateObject<LinkQueue>(m_ledger, rate, overhead_bytes);
            fifo->SetMaxSize(ns3::QueueSize(ns3::PACKETS, queue));
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
        Damage(back.device, there.queue, loss_there);
        Damage(there.device, back.queue, loss_back);
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
        Routes(m_ports[port].device->GetNode())
            ->AddHostRouteTo(HostAddress(address), m_ports[port ^ 1].address, m_ports[port].interface);
    }

    void AddSource(int64_t node)
    {
        m_sources.push_back({OpenSocket(node), {}, m_nodes[node]->GetId()});
    }

    // A controller, or, with the number CROSS, what takes a node's cross traffic.
    void AddDestination(int64_t node, int64_t number)
    {
        m_receivers.push_back({this, number});
        auto socket = OpenSocket(node);
        socket->Bind(ns3::InetSocketAddress(ns3::Ipv4Address::GetAny(), PortOf(number)));
        socket->SetRecvCallback(ns3::MakeCallback(&Receiver::Read, &m_receivers.back()));
    }

    // Add the next PMU flow; a frame goes to its destinations in this order.
    void AddFlow(int64_t source, int64_t destination, uint32_t address)
    {
        int64_t number = m_destinations.size();
        m_destinations.push_back(destination);
        m_sources[source].flows.push_back(
            {number, ns3::InetSocketAddress(HostAddress(address), PortOf(destination))});
    }

    // Cross traffic, which starts at once; all PMU flows stand before it.
    void AddCross(int64_t node, int64_t payload_bytes, uint32_t address, int64_t gaps)
    {
        int64_t number = m_destinations.size() + m_crosses.size();
        m_crosses.push_back({OpenSocket(node),
                             {number, ns3::InetSocketAddress(HostAddress(address), DISCARD_PORT)},
                             static_cast<uint32_t>(payload_bytes),
                             &m_supplies[gaps]});
        Plan(&m_crosses.back(), m_nodes[node]->GetId());
    }

    // A source's frame leaves it at an instant that has not passed.
    void Announce(int64_t at_ns,
                  int64_t source,
                  int64_t sequence,
                  const uint8_t* bytes,
                  int64_t size)
    {
        auto frame = std::make_shared<const std::vector<uint8_t>>(bytes, bytes + size);
        m_announced += m_sources[source].flows.size();
        TieOrder::Current().Announce(TieOrder::FRAME, m_frames++);
        Simulator::ScheduleWithContext(m_sources[source].context,
                                       ns3::NanoSeconds(at_ns) - Simulator::Now(),
                                       &Network::SendFrame,
                                       this,
                                       source,
                                       sequence,
                                       frame);
    }

    // Run to the end of an instant; false if a supply is low: fill it and call again.
    bool RunUntil(int64_t until_ns)
    {
        if (m_is_at_end)
        {
            m_is_at_end = false;
            TieOrder::Current().Announce(TieOrder::END_OF_STEP, 0);
            Simulator::Schedule(ns3::NanoSeconds(until_ns) - Simulator::Now(),
                                &Network::EndStep,
                                this);
        }
        Simulator::Run();
        return m_is_at_end;
    }

    // What went wrong, or nothing.
    std::string Fault() const
    {
        return m_ledger.m_fault;
    }

    int64_t PacketsInside() const
    {
        return m_ledger.m_packets.size();
    }

    // Packets of the frames that have not left their source.
    int64_t PacketsAnnounced() const
    {
        return m_announced;
    }

    int64_t EndedCount() const
    {
        return m_ledger.m_ended.size() / 4;
    }

    // Move the records of ended PMU packets to rows of time, flow, sequence, how.
    void CollectEnded(int64_t* rows)
    {
        std::copy(m_ledger.m_ended.begin(), m_ledger.m_ended.end(), rows);
        m_ledger.m_ended.clear();
    }

    // Cross packets sent, delivered, dropped at queues, lost on links.
    void CopyCross(int64_t* counts) const
    {
        counts[0] = m_cross_sent;
        std::copy(m_ledger.m_cross_ended, m_ledger.m_cross_ended + 3, counts + 1);
    }

    // Port by port: packets, bytes, dropped at the queue, lost, busy ns, most waiting.
    void CopyPorts(int64_t* rows) const
    {
        for (const Port& port : m_ports)
        {
            const LinkQueue& queue = *port.queue;
            int64_t ahead_ns = queue.m_free_at_ns - Simulator::Now().GetNanoSeconds();
            *rows++ = queue.m_packets;
            *rows++ = queue.m_bytes;
            *rows++ = queue.m_dropped_queue;
            *rows++ = queue.m_dropped_loss;
            *rows++ = queue.m_busy_ns - std::max<int64_t>(0, ahead_ns);
            *rows++ = queue.m_most_waiting;
        }
    }

  private:
    struct Port
    {
        Ptr<ns3::PointToPointNetDevice> device;
        Ptr<LinkQueue> queue;
        uint32_t interface;
        ns3::Ipv4Address address;
    };

    struct Flow
    {
        int64_t number;
        ns3::Address to;
    };

    struct Source
    {
        Ptr<ns3::Socket> socket;
        std::vector<Flow> flows;
        uint32_t context;
    };

    struct Cross
    {
        Ptr<ns3::Socket> socket;
        Flow flow;
        uint32_t payload_bytes;
        Supply* gaps;
    };

    struct Receiver
    {
        Network* network;
        int64_t number;

        void Read(Ptr<ns3::Socket> socket)
        {
            while (Ptr<ns3::Packet> packet = socket->Recv())
            {
                network->Receive(packet, number);
            }
        }
    };

    static uint16_t PortOf(int64_t destination)
    {
        return destination == CROSS ? DISCARD_PORT : FIRST_PORT + destination;
    }

    // 172.16.0.0/12 for flows, 10.0.0.0/8 in blocks of four for links.
    static ns3::Ipv4Address HostAddress(uint32_t number)
    {
        return ns3::Ipv4Address(0xAC100001 + number);
    }

    static ns3::Ipv4Address LinkAddress(uint32_t port)
    {
        return ns3::Ipv4Address(0x0A000001 + 4 * (port / 2) + port % 2);
    }

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

    void Damage(Ptr<ns3::PointToPointNetDevice> device, Ptr<LinkQueue> queue, int64_t losses)
    {
        if (losses >= 0 || !queue->HasPpp())
        {
            Supply* supply = losses < 0 ? nullptr : &m_supplies[losses];
            device->SetReceiveErrorModel(ns3::CreateObject<LinkErrors>(m_ledger, queue, supply));
        }
    }

    Ptr<ns3::Socket> OpenSocket(int64_t node) const
    {
        auto kind = ns3::UdpSocketFactory::GetTypeId();
        Ptr<ns3::Socket> socket = ns3::Socket::CreateSocket(m_nodes[node], kind);
        // ns-3 takes an address without a network for that network's broadcast address.
        socket->SetAllowBroadcast(true);
        return socket;
    }

    void SendFrame(int64_t source, int64_t sequence, std::shared_ptr<const std::vector<uint8_t>> frame)
    {
        m_announced -= m_sources[source].flows.size();
        for (const Flow& flow : m_sources[source].flows)
        {
            auto packet = ns3::Create<ns3::Packet>(frame->data(), frame->size());
            Send(m_sources[source].socket, packet, flow, {flow.number, sequence, frame});
        }
    }

    void SendCross(Cross* cross)
    {
        m_cross_sent++;
        auto packet = ns3::Create<ns3::Packet>(cross->payload_bytes);
        Send(cross->socket, packet, cross->flow, {cross->flow.number, 0, nullptr});
        Plan(cross, Simulator::GetContext());
    }

    void Plan(Cross* cross, uint32_t context)
    {
        ns3::Time gap = ns3::NanoSeconds(cross->gaps->Take());
        TieOrder::Current().Announce(TieOrder::PACKET, TieOrder::Current().NextPlace());
        Simulator::ScheduleWithContext(context, gap, &Network::SendCross, this, cross);
    }

    void Send(Ptr<ns3::Socket> socket, Ptr<ns3::Packet> packet, const Flow& flow, Ledger::Packet entry)
    {
        m_ledger.Begin(packet->GetUid(), std::move(entry));
        if (socket->SendTo(packet, 0, flow.to) < 0)
        {
            m_ledger.Blame("a socket could not send to flow " + std::to_string(flow.number) + " (error " + std::to_string(socket->GetErrno()) + ")");
        }
    }

    void Receive(Ptr<ns3::Packet> packet, int64_t destination)
    {
        const Ledger::Packet* sent = m_ledger.Find(packet->GetUid());
        if (sent != nullptr && sent->bytes != nullptr)
        {
            m_buffer.resize(packet->GetSize());
            packet->CopyData(m_buffer.data(), m_buffer.size());
            if (m_buffer != *sent->bytes || destination != m_destinations[sent->flow])
            {
                m_ledger.Blame("frame " + std::to_string(sent->sequence) + " of flow " +
                               std::to_string(sent->flow) +
                               " came with other bytes, or to another controller");
            }
        }
        m_ledger.Close(packet->GetUid(), DELIVERED);
    }

    void DroppedByIp(const ns3::Ipv4Header&,
                     Ptr<const ns3::Packet>,
                     ns3::Ipv4L3Protocol::DropReason reason,
                     Ptr<ns3::Ipv4>,
                     uint32_t)
    {
        m_ledger.Blame("IP dropped a packet for reason " + std::to_string(reason));
    }

    void EndStep()
    {
        m_is_at_end = true;
        Simulator::Stop();
    }

    Ledger m_ledger;
    std::vector<Ptr<ns3::Node>> m_nodes;
    std::vector<Port> m_ports;
    std::vector<Source> m_sources;
    std::vector<int64_t> m_destinations; // of each PMU flow
    // ns-3 keeps pointers into these: they must not move.
    std::deque<Supply> m_supplies;
    std::deque<Receiver> m_receivers;
    std::deque<Cross> m_crosses;
    std::vector<uint8_t> m_buffer;
    inline static bool s_is_open = false;
    uint64_t m_frames = 0;
    int64_t m_announced = 0;
    int64_t m_cross_sent = 0;
    bool m_is_at_end = true;
};

} // namespace tieline

#endif
