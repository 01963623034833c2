#include "isospline/util/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <tuple>
#include <utility>

namespace isospline {

void parallel_for(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body,
                  const Progress& progress)
{
    const std::size_t chunks = count / grain + (count % grain != 0);
    const std::size_t helpers = std::min<std::size_t>(chunks, static_cast<std::size_t>(thread_count())) - (chunks > 0);
    std::atomic<std::size_t> next = 0, finished = 0; // in chunks
    std::atomic<bool> is_stopped = false;
    std::mutex mutex; // of the next two, and of `progress`
    bool is_cancelled = false;
    std::exception_ptr raised;

    // Threads take parts of what is left, so that each works on neighbouring items, whose data its caches hold.
    const auto take = [&]() -> std::pair<std::size_t, std::size_t> {
        std::size_t first = next, last;
        do {
            last = first + std::min(std::max<std::size_t>((chunks - first) / (8 * (helpers + 1)), 1), chunks - first);
        } while (!next.compare_exchange_weak(first, last));
        return {first, last};
    };
    const auto run_chunk = [&](std::size_t chunk) {
        try {
            body(grain * chunk, std::min(grain * (chunk + 1), count));
            ++finished;
            if (!progress)
                return;
            // One thread at a time reports; the others continue with their work instead of waiting.
            const std::unique_lock lock(mutex, std::try_to_lock);
            if (lock && !is_stopped && !progress(static_cast<double>(finished) / static_cast<double>(chunks)))
                is_stopped = is_cancelled = true;
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!raised)
                raised = std::current_exception();
            is_stopped = true;
        }
    };
    const auto work = [&] {
        for (auto [chunk, last] = take(); chunk < last; std::tie(chunk, last) = take())
            for (; chunk < last && !is_stopped; ++chunk)
                run_chunk(chunk);
    };
    run_with_help(static_cast<int>(helpers), std::cref(work), std::cref(work));
    if (raised)
        std::rethrow_exception(raised);
    if (is_cancelled || (progress && !progress(1.0)))
        throw Cancelled();
}

} // namespace isospline
