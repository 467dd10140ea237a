// A whole network with the flows that use it, built and stepped from Python through cppyy.

#ifndef TIELINE_NS3_NETWORK_H
#define TIELINE_NS3_NETWORK_H

#include "topology.h"

#include "ns3/inet-socket-address.h"
#include "ns3/udp-socket-factory.h"

namespace tieline
{

class Network : public Topology
{
  public:
    static constexpr uint16_t FIRST_PORT = 10000;
    static constexpr uint16_t DISCARD_PORT = 9;
    static constexpr int64_t CROSS = -1;
    static constexpr int64_t UDP_BYTES = 8;

    // Args: nodes, how many; pmu_flows, whose numbers come before those of the cross flows.
    Network(int64_t nodes, int64_t pmu_flows)
        : Topology(nodes, pmu_flows)
    {
        s_is_open = true;
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

    void AddSource(int64_t node, uint8_t dscp)
    {
        m_sources.push_back({OpenSocket(node, dscp), {}, m_nodes[node]->GetId()});
    }

    // A controller, or, with the number CROSS, what takes a node's cross traffic.
    void AddDestination(int64_t node, int64_t number)
    {
        m_receivers.push_back({this, number});
        auto socket = OpenSocket(node, 0);
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
    // sizes: supply of its datagrams' sizes with the UDP header, or -1: all have payload_bytes.
    void AddCross(int64_t node,
                  uint32_t address,
                  uint8_t dscp,
                  int64_t payload_bytes,
                  int64_t sizes,
                  int64_t gaps)
    {
        int64_t number = m_destinations.size() + m_crosses.size();
        m_crosses.push_back({OpenSocket(node, dscp),
                             {number, ns3::InetSocketAddress(HostAddress(address), DISCARD_PORT)},
                             payload_bytes,
                             sizes < 0 ? nullptr : &m_supplies[sizes],
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

    // Port by port: packets, bytes, busy ns, dropped at the queue, lost on the link, lost with the
    // link (none), waiting now, most waiting since the span began.
    void CopyPorts(int64_t* rows) const
    {
        for (const Port& port : m_ports)
        {
            const LinkQueue& queue = *port.queue;
            int64_t ahead_ns = queue.m_free_at_ns - Simulator::Now().GetNanoSeconds();
            *rows++ = queue.m_carried_packets;
            *rows++ = queue.m_carried_bytes;
            *rows++ = queue.m_busy_ns - std::max<int64_t>(0, ahead_ns);
            *rows++ = queue.m_dropped_queue;
            *rows++ = queue.m_dropped_loss;
            *rows++ = 0;
            *rows++ = queue.GetNPackets();
            *rows++ = queue.m_most_waiting;
        }
    }

    // Begin a new span for the most that wait at each port.
    void BeginSpan()
    {
        for (Port& port : m_ports)
        {
            port.queue->m_most_waiting = port.queue->GetNPackets();
        }
    }

  private:
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
        int64_t payload_bytes;
        Supply* sizes;
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

    Ptr<ns3::Socket> OpenSocket(int64_t node, uint8_t dscp) const
    {
        auto kind = ns3::UdpSocketFactory::GetTypeId();
        Ptr<ns3::Socket> socket = ns3::Socket::CreateSocket(m_nodes[node], kind);
        // ns-3 takes an address without a network for that network's broadcast address.
        socket->SetAllowBroadcast(true);
        socket->SetIpTos(dscp << 2);
        return socket;
    }

    void SendFrame(int64_t source,
                   int64_t sequence,
                   std::shared_ptr<const std::vector<uint8_t>> frame)
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
        bool is_sized = cross->sizes != nullptr;
        int64_t bytes = is_sized ? cross->sizes->Take() - UDP_BYTES : cross->payload_bytes;
        auto packet = ns3::Create<ns3::Packet>(static_cast<uint32_t>(bytes));
        Send(cross->socket, packet, cross->flow, {cross->flow.number, 0, nullptr});
        Plan(cross, Simulator::GetContext());
    }

    void Plan(Cross* cross, uint32_t context)
    {
        ns3::Time gap = ns3::NanoSeconds(cross->gaps->Take());
        TieOrder::Current().Announce(TieOrder::PACKET, TieOrder::Current().NextPlace());
        Simulator::ScheduleWithContext(context, gap, &Network::SendCross, this, cross);
    }

    void Send(Ptr<ns3::Socket> socket,
              Ptr<ns3::Packet> packet,
              const Flow& flow,
              Ledger::Packet entry)
    {
        m_ledger.Begin(packet->GetUid(), std::move(entry));
        if (socket->SendTo(packet, 0, flow.to) < 0)
        {
            m_ledger.Blame("a socket could not send to flow " + std::to_string(flow.number) +
                           " (error " + std::to_string(socket->GetErrno()) + ")");
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

    void EndStep()
    {
        m_is_at_end = true;
        Simulator::Stop();
    }

    inline static bool s_is_open = false;
    std::vector<Source> m_sources;
    std::vector<int64_t> m_destinations; // of each PMU flow
    // ns-3 keeps pointers into these: they must not move.
    std::deque<Receiver> m_receivers;
    std::deque<Cross> m_crosses;
    std::vector<uint8_t> m_buffer;
    uint64_t m_frames = 0;
    int64_t m_announced = 0;
    int64_t m_cross_sent = 0;
    bool m_is_at_end = true;
};

} // namespace tieline

#endif
