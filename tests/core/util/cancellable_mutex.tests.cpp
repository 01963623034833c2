#include "isospline/util/cancellable_mutex.h"

#include "catch.h"

#include "isospline/util/lazy.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace isospline;

TEST_CASE("a wait for a mutex can be cancelled", "[util][threads]")
{
    CancellableMutex mutex;
    std::atomic<bool> cancelled = false;
    const CancellableMutex::Lock lock(mutex, {});
    REQUIRE(!lock.is_taken_over());
    std::thread waiting(
        [&] { REQUIRE_THROWS_AS(CancellableMutex::Lock(mutex, [&](double) { return !cancelled; }), Cancelled); });
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
    cancelled = true;
    waiting.join();
}

TEST_CASE("a lazy value is computed once, by the first call that does not throw", "[util][threads]")
{
    Lazy<int> lazy;
    REQUIRE(lazy.found() == nullptr);
    REQUIRE_THROWS_AS(lazy.get({}, []() -> int { throw std::range_error("no"); }), std::range_error);
    std::atomic<int> computed = 0;
    std::vector<const int*> results(8);
    std::vector<std::thread> threads;
    for (const int*& result : results)
        threads.emplace_back([&] {
            result = &lazy.get({}, [&] {
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
                return ++computed;
            });
        });
    for (std::thread& thread : threads)
        thread.join();
    REQUIRE(computed == 1);
    for (const int* result : results)
        REQUIRE((result == lazy.found() && *result == 1));
}
