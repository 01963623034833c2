#include "isospline/util/thread_pool.h"

#include "isospline/util/error.h"
#include "isospline/util/fork.h"
#include "isospline/util/start_thread.h"

#include <tbb/info.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <vector>

namespace isospline {

namespace {

/// A call of run_with_help().
struct Job {
    const std::function<void()>& help;
    int wanted;      ///< threads that may still begin to help
    int helping = 0; ///< threads that help at the moment
};

/// A loop of TBB would do the same, but its threads hold locks for a while after a loop has ended. A process that is
/// forked then inherits these locks. Threads of this pool wait in a condition variable, which holds none.
class Pool {
public:
    static Pool& instance()
    {
        // Not a static variable of this function: if a process is forked while one is initialised, the child waits for
        // it for ever. The pool is never destroyed, because its threads use it until the process ends.
        static constinit std::atomic<Pool*> the_pool = nullptr;
        if (Pool* const known = the_pool)
            return *known;
        auto made = std::make_unique<Pool>();
        Pool* known = nullptr;
        return the_pool.compare_exchange_strong(known, made.get()) ? *made.release() : *known;
    }

    void run(int most_helpers, const std::function<void()>& work, const std::function<void()>& help)
    {
        Job job{help, std::min(most_helpers, thread_count() - 1)};
        if (job.wanted <= 0)
            return work();
        {
            const std::lock_guard lock(mutex_);
            start_threads(job.wanted);
            jobs_.push_back(&job);
        }
        has_job_.notify_all();
        work();
        std::unique_lock lock(mutex_);
        if (job.wanted > 0)
            std::erase(jobs_, &job);
        has_finished_.wait(lock, [&] { return job.helping == 0; });
    }

    int thread_count() const
    {
        const std::lock_guard lock(mutex_);
        const bool threads_are_lost = threads_ > 0 && generation_ != fork_generation();
        return threads_are_lost ? 1 : limit_;
    }

    void limit_threads(int count)
    {
        const std::lock_guard lock(mutex_);
        limit_ = count > 0 ? count : tbb::info::default_concurrency();
    }

private:
    /// If the system has no more threads, the work is done by fewer.
    void start_threads(int wanted)
    {
        generation_ = fork_generation();
        try {
            for (; threads_ < wanted; ++threads_)
                start_thread([this] { help_for_ever(); });
        } catch (const std::exception&) {
        }
    }

    void help_for_ever()
    {
        std::unique_lock lock(mutex_);
        for (;;) {
            has_job_.wait(lock, [this] { return !jobs_.empty(); });
            Job& job = *jobs_.front();
            if (--job.wanted == 0)
                jobs_.erase(jobs_.begin());
            else
                std::rotate(jobs_.begin(), jobs_.begin() + 1, jobs_.end()); // the next thread helps another caller
            ++job.helping;
            lock.unlock();
            job.help();
            lock.lock();
            if (--job.helping == 0)
                has_finished_.notify_all();
        }
    }

    std::mutex& mutex_ = fork_safe_mutex(this);
    std::condition_variable has_job_, has_finished_;
    std::vector<Job*> jobs_; ///< that want more threads
    int threads_ = 0;
    int limit_ = tbb::info::default_concurrency();
    unsigned int generation_ = 0; ///< of the process that has the threads
};

} // namespace

void run_with_help(int most_helpers, const std::function<void()>& work, const std::function<void()>& help)
{
    Pool::instance().run(most_helpers, work, help);
}

void set_thread_count(int count)
{
    if (count < 0)
        throw_invalid("count", "a number of threads, or 0 for all", count);
    Pool::instance().limit_threads(count);
}

int thread_count()
{
    return Pool::instance().thread_count();
}

} // namespace isospline
