// A memory limit for data of volumes that are larger than the machine's memory.
#pragma once

#include "isospline/util/fork.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// Keeps the items of all holders together at about a limit: the least recently used ones are dropped. Items are only
/// dropped while no thread uses any, so that a look-up only needs the lock of the thread's own stripe. The limit may be
/// exceeded by the items that threads make before they next begin to use items.
class MemoryBudget {
public:
    struct Item {
        std::uint64_t last_use;
        std::size_t bytes;
    };

    /// An owner of items that can be made again.
    class Holder {
    public:
        virtual ~Holder() = default;
        /// Adds its items to a list.
        virtual void list_items(std::vector<Item>& items) const = 0;
        /// Drops the items that were last used at `time` or before. No item is in use during the call.
        virtual void drop_unused_since(std::uint64_t time) = 0;
    };

    /// While this object lives, the thread may use items. One a thread at a time. Does nothing without a budget.
    class InUse {
    public:
        explicit InUse(MemoryBudget* budget);
        ~InUse();
        InUse(const InUse&) = delete;
        InUse& operator=(const InUse&) = delete;

    private:
        TakeoverMutex* stripe_ = nullptr;
    };

    explicit MemoryBudget(std::size_t limit) : limit_(limit) {}
    MemoryBudget(const MemoryBudget&) = delete;
    MemoryBudget& operator=(const MemoryBudget&) = delete;

    void add(Holder& holder);
    /// Removes a holder; the caller subtracts the holder's bytes.
    void remove(Holder& holder);
    void count_up(std::size_t bytes) { held_.fetch_add(bytes, std::memory_order_relaxed); }
    void count_down(std::size_t bytes) { held_.fetch_sub(bytes, std::memory_order_relaxed); }
    /// The time, which advances when items are made.
    std::uint64_t now() const { return clock_.load(std::memory_order_relaxed) / ticks_per_time; }
    void tick() { clock_.fetch_add(1, std::memory_order_relaxed); }

    std::size_t limit() const { return limit_; }
    std::size_t held() const { return held_.load(std::memory_order_relaxed); }
    /// Items that were made and that were dropped so far.
    std::uint64_t made() const { return clock_.load(std::memory_order_relaxed); }
    std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }
    void count_dropped(std::uint64_t items) { dropped_.fetch_add(items, std::memory_order_relaxed); }

private:
    /// Items made together get the same time, so that threads write to a shared cache line less often.
    static constexpr std::uint64_t ticks_per_time = 64;
    static constexpr std::size_t stripe_count = 64;
    struct alignas(64) Stripe {
        TakeoverMutex mutex;
    };

    void make_room();

    const std::size_t limit_;
    std::atomic<std::size_t> held_ = 0;
    std::atomic<std::uint64_t> clock_ = 0, dropped_ = 0;
    std::vector<Holder*> holders_; ///< under the operation mutex
    std::array<Stripe, stripe_count> stripes_;
};

} // namespace isospline
