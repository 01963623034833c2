#include "call_threads.h"

#include "isospline/util/start_thread.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <pthread.h>

namespace isospline {

namespace {

std::atomic<bool> ending = false;
std::atomic<int> running = 0; ///< operations

class CallThread;

/// Threads that wait for an operation. Never destroyed: threads wait until the process ends.
struct IdleThreads {
    IdleThreads()
    {
        // A forked process has none of the threads.
        pthread_atfork([] { instance().mutex.lock(); }, [] { instance().mutex.unlock(); },
                       [] {
                           instance().threads.clear();
                           running = 0;
                           instance().mutex.unlock();
                       });
    }

    static IdleThreads& instance()
    {
        static auto& idle = *new IdleThreads;
        return idle;
    }

    std::mutex mutex;
    std::vector<CallThread*> threads;
};

class CallThread {
public:
    CallThread()
    {
        start_thread([this] { work(); });
    }

    std::future<void> start(std::function<void()> operation)
    {
        std::promise<void> done;
        std::future<void> result = done.get_future();
        {
            const std::lock_guard lock(mutex_);
            operation_ = std::move(operation);
            done_ = std::move(done);
        }
        has_operation_.notify_one();
        return result;
    }

private:
    [[noreturn]] void work()
    {
        for (;;) {
            std::unique_lock lock(mutex_);
            has_operation_.wait(lock, [this] { return static_cast<bool>(operation_); });
            std::function<void()> operation = std::exchange(operation_, nullptr);
            std::promise<void> done = std::move(done_);
            lock.unlock();

            ++running;
            std::exception_ptr raised;
            try {
                operation();
            } catch (...) {
                raised = std::current_exception();
            }
            operation = nullptr;
            --running;
            // Become idle before the caller is notified, so that its next call finds this thread.
            {
                IdleThreads& idle = IdleThreads::instance();
                const std::lock_guard idle_lock(idle.mutex);
                idle.threads.push_back(this);
            }
            if (raised)
                done.set_exception(std::exchange(raised, nullptr));
            else
                done.set_value();
        }
    }

    std::mutex mutex_;
    std::condition_variable has_operation_;
    std::function<void()> operation_;
    std::promise<void> done_;
};

} // namespace

std::future<void> run_on_call_thread(std::function<void()> operation)
{
    IdleThreads& idle = IdleThreads::instance();
    CallThread* thread = nullptr;
    {
        const std::lock_guard lock(idle.mutex);
        if (!idle.threads.empty()) {
            thread = idle.threads.back();
            idle.threads.pop_back();
        }
    }
    if (thread == nullptr)
        thread = new CallThread; // lives as long as the process
    return thread->start(std::move(operation));
}

bool process_is_ending()
{
    return ending;
}

void end_operations()
{
    ending = true;
    for (int i = 0; i < 2000 && running > 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

} // namespace isospline
