#include "isospline/util/memory_budget.h"

#include <algorithm>
#include <mutex>

namespace isospline {

namespace {

/// A number that identifies the thread.
std::size_t thread_number()
{
    static std::atomic<std::size_t> count = 0;
    thread_local const std::size_t number = count++;
    return number;
}

} // namespace

MemoryBudget::InUse::InUse(MemoryBudget* budget)
{
    if (budget == nullptr)
        return;
    if (budget->held() > budget->limit())
        budget->make_room();
    stripe_ = &budget->stripes_[thread_number() % stripe_count].mutex;
    stripe_->lock();
}

MemoryBudget::InUse::~InUse()
{
    if (stripe_ != nullptr)
        stripe_->unlock();
}

void MemoryBudget::add(Holder& holder)
{
    const std::lock_guard lock(operation_mutex());
    holders_.push_back(&holder);
}

void MemoryBudget::remove(Holder& holder)
{
    const std::lock_guard lock(operation_mutex());
    std::erase(holders_, &holder);
}

void MemoryBudget::make_room()
{
    // One thread is enough; others wait for their stripes.
    const std::unique_lock alone(operation_mutex(), std::try_to_lock);
    if (!alone.owns_lock())
        return;
    std::array<std::unique_lock<TakeoverMutex>, stripe_count> locks;
    for (std::size_t i = 0; i < stripe_count; ++i)
        locks[i] = std::unique_lock(stripes_[i].mutex);

    // Free a quarter of the limit, so that the list is rarely sorted.
    const std::size_t wanted = limit_ - limit_ / 4;
    std::vector<Item> items;
    for (const Holder* holder : holders_)
        holder->list_items(items);
    std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.last_use < b.last_use; });
    std::size_t left = held();
    auto item = items.begin();
    while (item != items.end() && left > wanted)
        left -= std::min(left, (item++)->bytes);
    if (item == items.begin())
        return;
    const std::uint64_t time = (item - 1)->last_use;
    for (Holder* holder : holders_)
        holder->drop_unused_since(time);
}

} // namespace isospline
