#include "isospline/util/memory_budget.h"

#include "catch.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

/// Items of a hundred bytes, by number.
class Items final : public MemoryBudget::Holder {
public:
    static constexpr std::size_t size = 100;

    explicit Items(MemoryBudget& budget) : budget_(budget) { budget_.add(*this); }
    ~Items() override
    {
        budget_.remove(*this);
        budget_.count_down(size * last_uses.size());
    }

    void make(int number, std::uint64_t time)
    {
        last_uses[number] = time;
        budget_.count_up(size);
    }
    void list_items(std::vector<MemoryBudget::Item>& items) const override
    {
        for (const auto& [number, last_use] : last_uses)
            items.push_back({last_use, size});
    }
    void drop_unused_since(std::uint64_t time) override
    {
        const std::size_t count = std::erase_if(last_uses, [&](const auto& item) { return item.second <= time; });
        budget_.count_down(size * count);
        budget_.count_dropped(count);
    }

    std::map<int, std::uint64_t> last_uses;

private:
    MemoryBudget& budget_;
};

} // namespace

TEST_CASE("the most recently used items stay within a budget", "[util]")
{
    MemoryBudget budget(10 * Items::size);
    Items first(budget), second(budget);
    for (int i = 0; i < 10; ++i)
        (i % 2 == 0 ? first : second).make(i, static_cast<std::uint64_t>(i));
    {
        const MemoryBudget::InUse in_use(&budget);
        REQUIRE(budget.held() == 10 * Items::size);
        REQUIRE(budget.dropped() == 0);
    }
    first.make(10, 10);
    const MemoryBudget::InUse in_use(&budget);
    REQUIRE(budget.held() <= 10 * Items::size - 10 * Items::size / 4);
    REQUIRE(budget.held() == Items::size * (first.last_uses.size() + second.last_uses.size()));
    REQUIRE(budget.dropped() == 4);
    for (int i = 0; i <= 10; ++i)
        REQUIRE((first.last_uses.count(i) + second.last_uses.count(i) == 1) == (i >= 4));
}

TEST_CASE("a removed holder is not used any more", "[util]")
{
    MemoryBudget budget(Items::size);
    {
        Items items(budget);
        items.make(1, 1);
        items.make(2, 2);
    }
    REQUIRE(budget.held() == 0);
    Items items(budget);
    items.make(1, 1);
    items.make(2, 2);
    const MemoryBudget::InUse in_use(&budget);
    REQUIRE(budget.dropped() == 2);
}

TEST_CASE("no item is dropped while a thread has items in use", "[util][threads]")
{
    MemoryBudget budget(50 * Items::size);
    Items items(budget);
    std::mutex mutex; // of `items`, between threads that use them at a time
    std::atomic<std::size_t> wrong = 0;
    std::vector<std::thread> threads;
    for (unsigned thread = 0; thread < 8; ++thread)
        threads.emplace_back([&, thread] {
            std::mt19937 random(thread);
            for (int i = 0; i < 2000; ++i) {
                const MemoryBudget::InUse in_use(&budget);
                const int number = static_cast<int>(random() % 200);
                {
                    const std::lock_guard lock(mutex);
                    if (items.last_uses.count(number) == 0)
                        items.make(number, budget.now());
                    budget.tick();
                }
                std::this_thread::yield();
                const std::lock_guard lock(mutex);
                wrong += items.last_uses.count(number) == 0;
            }
        });
    for (std::thread& thread : threads)
        thread.join();
    REQUIRE(wrong == 0);
    REQUIRE(budget.dropped() > 0);
    REQUIRE(budget.held() <= (50 + threads.size()) * Items::size);
}
