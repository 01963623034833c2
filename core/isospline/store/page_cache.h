// Pages of files; the least recently used ones are dropped when room is needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <unordered_map>
#include <vector>

namespace isospline {

/// Any number of threads may ask at the same time. Nobody waits: two threads that need the same missing page both load
/// it.
class PageCache {
public:
    using Page = std::vector<std::byte>;

    /// Pages are divided among stripes, each with a part of the limit, so that threads seldom ask for the same one.
    explicit PageCache(std::size_t stripe_count) : stripes_(stripe_count) {}

    /// The page of a key; it is loaded if it is missing. Then the least recently used pages are dropped until about
    /// `limit` bytes are left, but at least one page a stripe.
    std::shared_ptr<const Page> get(std::uint64_t key, std::size_t limit, const std::function<Page()>& load);
    std::size_t memory() const;

private:
    struct Entry {
        std::uint64_t key;
        std::shared_ptr<const Page> page;
    };

    /// Under the fork-safe mutex of its address.
    struct Stripe {
        std::list<Entry> entries; ///< the most recently used first
        std::unordered_map<std::uint64_t, std::list<Entry>::iterator> places;
        std::size_t bytes = 0;
    };

    std::vector<Stripe> stripes_;
};

} // namespace isospline
