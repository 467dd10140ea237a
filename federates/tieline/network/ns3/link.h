// What every packet meets: where its fate is noted, the queues, and the losses on links.

#ifndef TIELINE_NS3_LINK_H
#define TIELINE_NS3_LINK_H

#include "order.h"

#include "ns3/data-rate.h"
#include "ns3/drop-tail-queue.h"
#include "ns3/error-model.h"
#include "ns3/packet.h"
#include "ns3/ppp-header.h"
#include "ns3/queue-size.h"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace tieline
{

using ns3::Ptr;

enum End
{
    DELIVERED,
    QUEUE_FULL,
    LOSS
};

// Random numbers from outside. It stops the simulation when fewer than one chunk is left, so that
// more can be given before the next event.
class Supply
{
  public:
    explicit Supply(size_t least)
        : m_least(least)
    {
    }

    void Add(const int64_t* values, size_t count)
    {
        m_values.insert(m_values.end(), values, values + count);
    }

    int64_t Take()
    {
        int64_t value = m_values.front();
        m_values.pop_front();
        if (IsLow())
        {
            Simulator::Stop();
        }
        return value;
    }

    bool IsLow() const
    {
        return m_values.size() < m_least;
    }

  private:
    std::deque<int64_t> m_values;
    size_t m_least;
};

// The losses of one direction of a link, as the packet engine takes them: gaps from one loss to the
// next, in packets or in bits on the link.
class Losses
{
  public:
    Losses(Supply* gaps, bool is_per_bit)
        : m_gaps(gaps),
          m_is_per_bit(is_per_bit),
          m_left(gaps->Take())
    {
    }

    // Whether the link loses its next packet, of so many bytes.
    bool Next(int64_t size_bytes)
    {
        m_left -= m_is_per_bit ? 8 * size_bytes : 1;
        bool is_lost = m_left <= 0;
        while (m_left <= 0)
        {
            m_left += m_gaps->Take();
        }
        return is_lost;
    }

  private:
    Supply* m_gaps;
    bool m_is_per_bit;
    int64_t m_left;
};

// What becomes of the packets under way, by ns-3's number of each.
class Ledger
{
  public:
    struct Packet
    {
        int64_t flow;
        int64_t sequence;
        std::shared_ptr<const std::vector<uint8_t>> bytes; // none: cross traffic
    };

    explicit Ledger(int64_t pmu_flows)
        : m_pmu_flows(pmu_flows)
    {
    }

    void Begin(uint64_t uid, Packet packet)
    {
        m_packets.emplace(uid, std::move(packet));
    }

    const Packet* Find(uint64_t uid) const
    {
        auto found = m_packets.find(uid);
        return found == m_packets.end() ? nullptr : &found->second;
    }

    void Close(uint64_t uid, End how)
    {
        const Packet* packet = Find(uid);
        if (packet == nullptr)
        {
            Blame("a packet that nobody sent came to its end");
            return;
        }
        if (packet->flow < m_pmu_flows)
        {
            int64_t now_ns = Simulator::Now().GetNanoSeconds();
            m_ended.insert(m_ended.end(), {now_ns, packet->flow, packet->sequence, how});
        }
        else
        {
            m_cross_ended[how]++;
        }
        m_packets.erase(uid);
    }

    // Note what should not happen; only the first counts.
    void Blame(const std::string& fault)
    {
        m_fault = m_fault.empty() ? fault : m_fault;
    }

    std::unordered_map<uint64_t, Packet> m_packets;
    std::vector<int64_t> m_ended; // time, flow, sequence, how, of PMU packets
    int64_t m_cross_ended[3] = {0, 0, 0};
    std::string m_fault;

  private:
    int64_t m_pmu_flows;
};

// ns-3's drop-tail queue, which puts the link layer's bytes around a packet and counts.
//
// A device asks it for a packet when it begins to transmit, and gets none when it has become idle.
// Bytes beyond PPP's two trail, and the IP layer at the far end cuts them off; with fewer than two
// the PPP header is left out on the link.
class LinkQueue : public ns3::DropTailQueue<ns3::Packet>
{
  public:
    static constexpr int64_t PPP_BYTES = 2;

    // most_bytes: that may wait, besides the limit in packets, which ns-3 keeps.
    LinkQueue(Ledger& ledger, ns3::DataRate rate, int64_t most_bytes, int64_t overhead_bytes)
        : m_ledger(ledger),
          m_rate(rate),
          m_most_bytes(most_bytes),
          m_overhead_bytes(overhead_bytes)
    {
    }

    bool HasPpp() const
    {
        return m_overhead_bytes >= PPP_BYTES;
    }

    bool Enqueue(Ptr<ns3::Packet> packet) override
    {
        if (!HasPpp())
        {
            packet->RemoveAtStart(PPP_BYTES);
        }
        packet->AddPaddingAtEnd(m_overhead_bytes - (HasPpp() ? PPP_BYTES : 0));
        bool is_over = m_is_busy && GetNBytes() + packet->GetSize() > m_most_bytes;
        if (is_over || !DropTailQueue::Enqueue(packet))
        {
            m_dropped_queue++;
            m_ledger.Close(packet->GetUid(), QUEUE_FULL);
            return false;
        }
        m_places.push_back(TieOrder::Current().NextPlace());
        m_carried_packets++;
        m_carried_bytes += packet->GetSize();
        if (m_is_busy)
        {
            m_most_waiting = std::max<int64_t>(m_most_waiting, GetNPackets());
        }
        return true;
    }

    Ptr<ns3::Packet> Dequeue() override
    {
        Ptr<ns3::Packet> packet = DropTailQueue::Dequeue();
        m_is_busy = packet != nullptr;
        if (m_is_busy)
        {
            TieOrder::Current().Hand(m_places.front());
            m_places.pop_front();
            int64_t service_ns = m_rate.CalculateBytesTxTime(packet->GetSize()).GetNanoSeconds();
            m_busy_ns += service_ns;
            m_free_at_ns = Simulator::Now().GetNanoSeconds() + service_ns;
        }
        return packet;
    }

    int64_t m_carried_packets = 0;
    int64_t m_carried_bytes = 0;
    int64_t m_dropped_queue = 0;
    int64_t m_dropped_loss = 0;
    int64_t m_busy_ns = 0;
    int64_t m_free_at_ns = 0;
    int64_t m_most_waiting = 0;

  private:
    Ledger& m_ledger;
    ns3::DataRate m_rate;
    int64_t m_most_bytes;
    int64_t m_overhead_bytes;
    bool m_is_busy = false;
    std::deque<uint64_t> m_places;
};

// The receiving end of a link, which throws away what the link has lost.
class LinkErrors : public ns3::ErrorModel
{
  public:
    LinkErrors(Ledger& ledger, Ptr<LinkQueue> queue, std::unique_ptr<Losses> losses)
        : m_ledger(ledger),
          m_queue(queue),
          m_losses(std::move(losses))
    {
    }

  private:
    bool DoCorrupt(Ptr<ns3::Packet> packet) override
    {
        if (m_losses != nullptr && m_losses->Next(packet->GetSize()))
        {
            m_queue->m_dropped_loss++;
            m_ledger.Close(packet->GetUid(), LOSS);
            return true;
        }
        if (!m_queue->HasPpp())
        {
            ns3::PppHeader header;
            header.SetProtocol(0x0021); // IPv4
            packet->AddHeader(header);
        }
        return false;
    }

    void DoReset() override
    {
    }

    Ledger& m_ledger;
    Ptr<LinkQueue> m_queue;
    std::unique_ptr<Losses> m_losses;
};

} // namespace tieline

#endif
