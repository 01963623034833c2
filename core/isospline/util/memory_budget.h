// A memory limit for data of volumes that are larger than the machine's memory.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// Keeps the items of all holders together at about a limit: the least recently used ones are dropped, except those
/// that threads use. Nobody waits for these threads, so the limit may be exceeded by the items in use and by those that
/// threads are making.
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
        // One thread at a time calls these. They must not wait for threads that use items or make them.
        /// Adds its items to a list.
        virtual void list_items(std::vector<Item>& items) const = 0;
        /// Drops the items that were last used at `time` or before and are not in use.
        virtual void drop_unused_since(std::uint64_t time) = 0;
    };

    explicit MemoryBudget(std::size_t limit) : limit_(limit) {}
    MemoryBudget(const MemoryBudget&) = delete;
    MemoryBudget& operator=(const MemoryBudget&) = delete;

    void add(Holder& holder);
    /// Removes a holder; the caller subtracts the holder's bytes.
    void remove(Holder& holder);
    /// Call this before an item is made: drops items if the limit is exceeded. It waits for other threads that are
    /// dropping items, but not for those that use or make items.
    void make_room();
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

    const std::size_t limit_;
    std::atomic<std::size_t> held_ = 0;
    std::atomic<std::uint64_t> clock_ = 0, dropped_ = 0;
    std::vector<Holder*> holders_; ///< under the mutex of budgets
};

} // namespace isospline
