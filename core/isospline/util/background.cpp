#include "isospline/util/background.h"

#include "isospline/util/fork.h"
#include "isospline/util/start_thread.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace isospline {

namespace {

using Task = std::function<void(const Progress&)>;

/// Forks in progress; also 1 from the end of the process on. Tasks run only while this is zero.
std::atomic<int> stops = 0;
std::atomic<int> unfinished = 0; ///< tasks, including those that have not begun

/// Counts as an unfinished task.
struct Unfinished {
    Unfinished() { ++unfinished; }
    ~Unfinished() { --unfinished; }
};

/// Idle threads wait for further tasks instead of ending: the end of a thread locks mutexes of TBB, in which it has
/// been.
class Background {
public:
    static Background& instance()
    {
        const std::lock_guard lock(fork_safe_mutex(&current_));
        if (current_ == nullptr)
            current_ = new Background; // never destroyed: its threads use it until the process ends
        return *current_;
    }

    /// A child makes one of its own, because its parent's threads wait in the condition variable of this one for ever.
    static void forget() { current_ = nullptr; }

    bool run(Task task)
    {
        const std::lock_guard lock(mutex_);
        const Unfinished counted; // before the test: either this sees the stop, or the stop sees this
        if (stops != 0)
            return false;
        tasks_.push_back(std::move(task));
        if (idle_ > 0) {
            --idle_;
            has_task_.notify_one();
        } else {
            try {
                start_thread([this] { work_for_ever(); });
            } catch (...) {
                tasks_.pop_back();
                throw;
            }
        }
        ++unfinished; // until its end
        return true;
    }

private:
    void work_for_ever()
    {
        std::unique_lock lock(mutex_);
        for (;;) {
            has_task_.wait(lock, [this] { return !tasks_.empty(); });
            Task task = std::move(tasks_.back());
            tasks_.pop_back();
            lock.unlock();
            task([](double) { return stops == 0; });
            task = nullptr;
            lock.lock();
            ++idle_;
            --unfinished;
        }
    }

    static inline Background* current_ = nullptr;

    std::mutex& mutex_ = fork_safe_mutex(this);
    std::condition_variable has_task_;
    std::vector<Task> tasks_; ///< that have not begun
    int idle_ = 0;            ///< waiting threads less these tasks
};

[[maybe_unused]] const int has_exit_handler = std::atexit(stop_background_tasks);

} // namespace

bool run_in_background(std::function<void(const Progress&)> task)
{
    return Background::instance().run(std::move(task));
}

void stop_background_tasks()
{
    ++stops;
    while (unfinished != 0)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
}

void allow_background_tasks()
{
    --stops;
}

void allow_background_tasks_in_child()
{
    stops = 0;
    Background::forget();
}

} // namespace isospline
