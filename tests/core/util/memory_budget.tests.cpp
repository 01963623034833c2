#include "isospline/util/memory_budget.h"

#include "catch.h"

#include <cstddef>
#include <cstdint>
#include <map>
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
    budget.make_room();
    REQUIRE(budget.held() == 10 * Items::size);
    REQUIRE(budget.dropped() == 0);
    first.make(10, 10);
    budget.make_room();
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
    budget.make_room();
    REQUIRE(budget.dropped() == 2);
}
