#include "isospline/store/page_cache.h"

#include "isospline/util/fork.h"

#include <mutex>
#include <utility>

namespace isospline {

std::shared_ptr<const PageCache::Page> PageCache::get(std::uint64_t key, std::size_t limit,
                                                      const std::function<Page()>& load)
{
    // The multiplication puts neighbours into different stripes.
    Stripe& stripe = stripes_[(key * 0x9e3779b97f4a7c15u >> 32) % stripes_.size()];
    {
        const std::lock_guard lock(fork_safe_mutex(&stripe));
        if (const auto found = stripe.places.find(key); found != stripe.places.end()) {
            stripe.entries.splice(stripe.entries.begin(), stripe.entries, found->second);
            return found->second->page;
        }
    }
    auto page = std::make_shared<const Page>(load());
    const std::lock_guard lock(fork_safe_mutex(&stripe));
    if (const auto found = stripe.places.find(key); found != stripe.places.end())
        return found->second->page;
    stripe.entries.push_front({key, page});
    stripe.places[key] = stripe.entries.begin();
    stripe.bytes += page->size();
    while (stripe.bytes > limit / stripes_.size() && stripe.entries.size() > 1) {
        stripe.bytes -= stripe.entries.back().page->size();
        stripe.places.erase(stripe.entries.back().key);
        stripe.entries.pop_back();
    }
    return page;
}

std::size_t PageCache::memory() const
{
    std::size_t bytes = 0;
    for (const Stripe& stripe : stripes_) {
        const std::lock_guard lock(fork_safe_mutex(&stripe));
        bytes += stripe.bytes;
    }
    return bytes;
}

} // namespace isospline
