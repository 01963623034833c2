#include "isospline/util/memory_budget.h"

#include "isospline/util/fork.h"

#include <algorithm>
#include <mutex>

namespace isospline {

void MemoryBudget::add(Holder& holder)
{
    const std::lock_guard lock(budget_mutex());
    holders_.push_back(&holder);
}

void MemoryBudget::remove(Holder& holder)
{
    const std::lock_guard lock(budget_mutex());
    std::erase(holders_, &holder);
}

void MemoryBudget::make_room()
{
    if (held() <= limit_)
        return;
    // Others wait here. Otherwise they would make items without end while this thread waits for a core.
    const std::lock_guard alone(budget_mutex());
    if (held() <= limit_) // another thread has made room
        return;

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
