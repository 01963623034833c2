// Waiting for other threads with the possibility to cancel.
#pragma once

#include "isospline/util/fork.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <chrono>
#include <thread>

namespace isospline {

/// A mutex for long operations. A forked process takes it over if a thread of its parent held it, because that thread
/// does not exist in the child; so what it guards must be whole at any moment, or be checked.
class CancellableMutex {
public:
    /// Holds the mutex for one thread as long as it lives.
    class Lock {
    public:
        /// Waits until no other thread holds the mutex. Meanwhile it calls `progress`, if any, repeatedly, and throws
        /// Cancelled if that returns false.
        Lock(CancellableMutex& mutex, const Progress& progress) : holder_(mutex.holder_)
        {
            const unsigned int mine = fork_generation() + 1;
            for (;;) {
                unsigned int other = 0;
                if (holder_.compare_exchange_strong(other, mine, std::memory_order_acquire))
                    return;
                is_taken_over_ =
                    other != mine && holder_.compare_exchange_strong(other, mine, std::memory_order_acquire);
                if (is_taken_over_)
                    return;
                report(progress, 0.0);
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
        ~Lock() { holder_.store(0, std::memory_order_release); }
        Lock(const Lock&) = delete;
        Lock& operator=(const Lock&) = delete;

        /// Whether a thread of the parent process held the mutex when this process was forked.
        bool is_taken_over() const { return is_taken_over_; }

    private:
        std::atomic<unsigned int>& holder_;
        bool is_taken_over_ = false;
    };

private:
    std::atomic<unsigned int> holder_ = 0; ///< 1 + the fork generation of the holder; 0 if free
};

} // namespace isospline
