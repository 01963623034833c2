// Forked processes: a child has the memory of its parent's other threads, but not the threads, and must not wait for
// them.
#pragma once

#include <atomic>
#include <mutex>

namespace isospline {

/// The number of forks between this process and the one that loaded the library.
unsigned int fork_generation();

/// A mutex that is never locked during a fork, for code that reads or swaps a few pointers of the object at `address`.
/// While it is locked, no code may lock another one, wait, or work for long: unrelated objects share it.
std::mutex& moment_mutex(const void* address);

/// The process's one mutex that is never locked during a fork, for code that works for milliseconds. Whoever holds it
/// may lock moment mutexes and takeover mutexes, and not the other way round.
std::mutex& operation_mutex();

/// A mutex that a forked process takes over where a thread of its parent held it: that thread does not exist in the
/// child. What it guards must be whole at any moment.
class TakeoverMutex {
public:
    enum class Attempt { failed, locked, taken_over };

    Attempt attempt()
    {
        const unsigned int mine = fork_generation() + 1;
        unsigned int holder = 0;
        if (holder_.compare_exchange_strong(holder, mine, std::memory_order_acquire))
            return Attempt::locked;
        if (holder != mine && holder_.compare_exchange_strong(holder, mine, std::memory_order_acquire))
            return Attempt::taken_over;
        return Attempt::failed;
    }
    void lock()
    {
        while (attempt() == Attempt::failed)
            holder_.wait(fork_generation() + 1, std::memory_order_relaxed);
    }
    void unlock()
    {
        holder_.store(0, std::memory_order_release);
        holder_.notify_one();
    }

private:
    std::atomic<unsigned int> holder_ = 0; ///< 1 + the fork generation of the holder; 0 if free
};

/// An object that lives while threads of TBB or Embree work for the caller. A child that is forked meanwhile inherits
/// the locks of these libraries in an unknown state.
class InParallel {
public:
    InParallel();
    ~InParallel();
    InParallel(const InParallel&) = delete;
    InParallel& operator=(const InParallel&) = delete;
};

/// Whether TBB's threads exist: false in a child whose parent has used them.
bool has_worker_threads();

/// Whether TBB and Embree can be called: false in a child whose parent was working with them when it was forked.
bool is_whole_after_fork();

} // namespace isospline
