#include "catch.h"

#include "isospline/util/parallel.h"

#include <atomic>
#include <vector>

TEST_CASE("parallel_for visits every item once", "[util][threads]")
{
    std::vector<std::atomic<int>> visits(1000);
    isospline::parallel_for(visits.size(), 7, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            ++visits[i];
    });
    for (const auto& count : visits)
        REQUIRE(count == 1);
}

TEST_CASE("parallel_for reports progress up to 1 and stops where that returns false", "[util][threads]")
{
    double last = 0.0;
    isospline::parallel_for(
        100, 1, [](std::size_t, std::size_t) {},
        [&](double fraction) {
            last = fraction;
            return true;
        });
    REQUIRE(last == 1.0);

    std::atomic<int> bodies = 0;
    REQUIRE_THROWS_AS(isospline::parallel_for(
                          100000, 1, [&](std::size_t, std::size_t) { ++bodies; }, [](double) { return false; }),
                      isospline::Cancelled);
    REQUIRE(bodies < 100000);
}

TEST_CASE("set_thread_count limits and restores the threads", "[util][threads]")
{
    const int all = isospline::thread_count();
    isospline::set_thread_count(1);
    REQUIRE(isospline::thread_count() == 1);
    isospline::set_thread_count(0);
    REQUIRE(isospline::thread_count() == all);
    REQUIRE_THROWS_AS(isospline::set_thread_count(-1), std::invalid_argument);
}
