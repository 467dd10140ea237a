// The order of simultaneous events.

#ifndef TIELINE_NS3_ORDER_H
#define TIELINE_NS3_ORDER_H

#include "ns3/scheduler.h"
#include "ns3/simulator.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace tieline
{

using ns3::Simulator;

// Orders simultaneous events as tieline's own packet engine does: ports that become free, then
// packets and cross traffic in the order in which they were let into a queue or planned, then
// frames, then the end of the step. ns-3 leaves this order open to its schedulers; its own take
// the events as they were inserted.
class TieOrder : public ns3::Scheduler
{
  public:
    enum Turn : uint64_t
    {
        PORT,
        PACKET,
        FRAME,
        END_OF_STEP
    };

    static ns3::TypeId GetTypeId()
    {
        static ns3::TypeId tid = ns3::TypeId("tieline::TieOrder")
                                     .SetParent<ns3::Scheduler>()
                                     .AddConstructor<TieOrder>();
        return tid;
    }

    TieOrder()
    {
        s_current = this;
    }

    // ns-3 makes the scheduler in use itself.
    static TieOrder& Current()
    {
        return *s_current;
    }

    // The next place in the order of packets.
    uint64_t NextPlace()
    {
        return m_next_place++;
    }

    // The next event inserted takes this turn and place.
    void Announce(Turn turn, uint64_t place)
    {
        m_announced = Rank(turn, place);
        m_is_announced = true;
    }

    // The packet that a device hands to its channel next has this place.
    void Hand(uint64_t place)
    {
        m_handed = place;
    }

    void Insert(const Event& event) override
    {
        uint64_t rank = Rank(PORT, 0);
        if (m_is_announced)
        {
            rank = m_announced;
            m_is_announced = false;
        }
        else if (event.key.m_context != Simulator::GetContext())
        {
            // A node plans events of its own for itself; only a channel does for another node.
            rank = Rank(PACKET, m_handed);
        }
        m_heap.push_back({event, rank});
        std::push_heap(m_heap.begin(), m_heap.end(), IsLater);
    }

    bool IsEmpty() const override
    {
        return m_heap.empty();
    }

    Event PeekNext() const override
    {
        return m_heap.front().event;
    }

    Event RemoveNext() override
    {
        std::pop_heap(m_heap.begin(), m_heap.end(), IsLater);
        Event event = m_heap.back().event;
        m_heap.pop_back();
        return event;
    }

    void Remove(const Event& event) override
    {
        auto is_same = [&](const Entry& entry) { return entry.event == event; };
        m_heap.erase(std::find_if(m_heap.begin(), m_heap.end(), is_same));
        std::make_heap(m_heap.begin(), m_heap.end(), IsLater);
    }

  private:
    struct Entry
    {
        Event event;
        uint64_t rank;
    };

    static uint64_t Rank(Turn turn, uint64_t place)
    {
        return turn << 62 | place;
    }

    static bool IsLater(const Entry& a, const Entry& b)
    {
        if (a.event.key.m_ts != b.event.key.m_ts)
        {
            return a.event.key.m_ts > b.event.key.m_ts;
        }
        return a.rank != b.rank ? a.rank > b.rank : a.event.key.m_uid > b.event.key.m_uid;
    }

    inline static TieOrder* s_current = nullptr;
    std::vector<Entry> m_heap;
    uint64_t m_next_place = 1;
    uint64_t m_handed = 0;
    uint64_t m_announced = 0;
    bool m_is_announced = false;
};

} // namespace tieline

#endif
