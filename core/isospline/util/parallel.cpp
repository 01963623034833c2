#include "isospline/util/parallel.h"

#include "isospline/util/error.h"
#include "isospline/util/fan_out.h"
#include "isospline/util/fork.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>

namespace isospline {

namespace {

std::unique_ptr<tbb::global_control> thread_limit;

template <typename Body>
void for_each_chunk(const tbb::blocked_range<std::size_t>& range, tbb::task_group_context& context, Body body)
{
    FanOut fan_out;
    tbb::parallel_for(
        range,
        [&](const auto& chunk) {
            const FanOut::Task task(fan_out);
            body(chunk);
        },
        tbb::simple_partitioner(), context);
}

/// The same without TBB.
void on_this_thread(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body,
                    const Progress& progress)
{
    for (std::size_t begin = 0; begin < count; begin += grain) {
        body(begin, std::min(begin + grain, count));
        report(progress, static_cast<double>(std::min(begin + grain, count)) / static_cast<double>(count));
    }
    report(progress, 1.0);
}

} // namespace

void parallel_for(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body,
                  const Progress& progress)
{
    if (!has_worker_threads())
        return on_this_thread(count, grain, body, progress);
    const InParallel in_parallel;
    const tbb::blocked_range<std::size_t> range(0, count, grain);
    tbb::task_group_context context;
    if (!progress) {
        for_each_chunk(range, context, [&](const auto& chunk) { body(chunk.begin(), chunk.end()); });
        return;
    }

    // One thread at a time reports; the others continue with their work instead of waiting.
    std::atomic<bool> cancelled = false;
    std::atomic<std::size_t> finished = 0;
    std::mutex reporting;
    for_each_chunk(range, context, [&](const auto& chunk) {
        if (cancelled)
            return;
        body(chunk.begin(), chunk.end());
        finished += chunk.size();
        const std::unique_lock lock(reporting, std::try_to_lock);
        if (lock && !cancelled && !progress(static_cast<double>(finished) / static_cast<double>(count))) {
            cancelled = true;
            context.cancel_group_execution();
        }
    });
    if (cancelled || !progress(1.0))
        throw Cancelled();
}

void set_thread_count(int count)
{
    if (count < 0)
        throw_invalid("thread_count", "a number of threads, or 0 for all", count);
    if (!has_worker_threads())
        return;
    const std::lock_guard lock(moment_mutex(&thread_limit));
    thread_limit.reset();
    if (count > 0)
        thread_limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                             static_cast<std::size_t>(count));
}

int thread_count()
{
    if (!has_worker_threads())
        return 1;
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

} // namespace isospline
