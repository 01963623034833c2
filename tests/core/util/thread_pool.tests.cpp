#include "isospline/util/thread_pool.h"

#include "catch.h"

#include "isospline/util/parallel.h"
#include "isospline/util/tbb_tasks.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

/// Restores the number of threads.
struct Threads {
    explicit Threads(int count) { set_thread_count(count); }
    ~Threads() { set_thread_count(0); }
};

std::size_t threads_of_process()
{
    const std::filesystem::directory_iterator begin("/proc/self/task");
    return static_cast<std::size_t>(std::distance(begin, {}));
}

} // namespace

TEST_CASE("helpers work at the same time, and their work is seen after the call", "[util][threads]")
{
    const Threads threads(4);
    int results[4] = {};
    std::atomic<int> next = 0;
    const auto work = [&] {
        const int mine = next++;
        while (next < 4) // all four are needed
            std::this_thread::yield();
        results[mine] = mine + 1;
    };
    run_with_help(3, work, work);
    for (int i = 0; i < 4; ++i)
        REQUIRE(results[i] == i + 1);
}

TEST_CASE("no more threads help than are wanted", "[util][threads]")
{
    const Threads threads(4);
    for (const int wanted : {0, 1, 2}) {
        std::mutex mutex;
        std::set<std::thread::id> ids;
        for (int repetition = 0; repetition < 200; ++repetition) {
            std::atomic<int> calls = 0;
            const auto work = [&] {
                ++calls;
                const std::lock_guard lock(mutex);
                ids.insert(std::this_thread::get_id());
            };
            run_with_help(wanted, work, work);
            REQUIRE((calls >= 1 && calls <= 1 + wanted));
        }
        REQUIRE(ids.count(std::this_thread::get_id()) == 1);
        REQUIRE((wanted > 0 || ids.size() == 1));
    }
}

TEST_CASE("loops inside loops of several callers visit every item once", "[util][threads]")
{
    const Threads threads(4);
    std::vector<std::vector<std::atomic<int>>> visits(4);
    for (auto& of_caller : visits)
        of_caller = std::vector<std::atomic<int>>(40 * 50);
    std::vector<std::thread> callers;
    for (auto& of_caller : visits)
        callers.emplace_back([&of_caller] {
            parallel_for(40, 3, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    parallel_for(50, 4, [&](std::size_t first, std::size_t last) {
                        for (std::size_t k = first; k < last; ++k)
                            ++of_caller[50 * i + k];
                    });
            });
        });
    for (std::thread& caller : callers)
        caller.join();
    for (const auto& of_caller : visits)
        for (const auto& count : of_caller)
            REQUIRE(count == 1);
}

TEST_CASE("the first exception ends a loop and is thrown", "[util][threads]")
{
    const Threads threads(4);
    std::atomic<std::size_t> bodies = 0;
    REQUIRE_THROWS_AS(parallel_for(1'000'000, 1,
                                   [&](std::size_t begin, std::size_t) {
                                       ++bodies;
                                       if (begin == 10)
                                           throw std::range_error("ten");
                                   }),
                      std::range_error);
    REQUIRE(bodies < 1'000'000);
    parallel_for(0, 1, [&](std::size_t, std::size_t) { throw std::range_error("none"); });
}

TEST_CASE("helpers have the default floating-point environment", "[util][threads]")
{
    const Threads threads(4);
    std::fesetround(FE_UPWARD); // before threads start, perhaps
    std::atomic<int> other = 0;
    const auto help = [&] { other += std::fegetround() != FE_TONEAREST; };
    run_with_help(
        3, [] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }, help);
    std::fesetround(FE_TONEAREST);
    REQUIRE(other == 0);
}

TEST_CASE("TBB's tasks run on the threads of the pool, and TBB starts none", "[util][threads]")
{
    const Threads threads(4);
    const auto work = [] { std::this_thread::sleep_for(std::chrono::milliseconds(5)); };
    run_with_help(3, work, work); // starts the pool's threads
    const std::size_t before = threads_of_process();
    for (int repetition = 0; repetition < 5; ++repetition) {
        std::vector<std::atomic<int>> visits(10'000);
        const auto visit = [&](std::size_t i) { ++visits[i]; };
        run_tbb_tasks([&] { tbb::parallel_for(std::size_t{0}, visits.size(), visit); });
        for (const auto& count : visits)
            REQUIRE(count == 1);
    }
    REQUIRE(threads_of_process() == before);
    REQUIRE_THROWS_AS(run_tbb_tasks([] { throw std::range_error("work"); }), std::range_error);
}
