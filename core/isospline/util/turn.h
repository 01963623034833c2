// Waiting for other threads, in a way that can be cancelled.
#pragma once

#include "isospline/util/fork.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <chrono>
#include <thread>

namespace isospline {

/// What one thread at a time may do, for as long as it takes: a mutex whose wait can be cancelled. A forked process
/// takes it from a thread of its parent's, which it does not have.
class Turn {
public:
    /// Taken by one thread, to the end of its life.
    class Taken {
    public:
        /// Waits until no other has it, asks `progress`, if any, again and again, and throws Cancelled where that
        /// returns false.
        Taken(Turn& turn, const Progress& progress) : turn_(turn)
        {
            const unsigned int mine = fork_generation() + 1;
            for (;;) {
                unsigned int taken_by = turn_.taken_by_;
                if (taken_by != mine && turn_.taken_by_.compare_exchange_strong(taken_by, mine)) {
                    was_abandoned_ = taken_by != 0;
                    return;
                }
                if (progress && !progress(0.0))
                    throw Cancelled();
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
        ~Taken() { turn_.taken_by_ = 0; }
        Taken(const Taken&) = delete;
        Taken& operator=(const Taken&) = delete;

        /// Whether the thread before had not finished when this process was forked.
        bool was_abandoned() const { return was_abandoned_; }

    private:
        Turn& turn_;
        bool was_abandoned_ = false;
    };

private:
    std::atomic<unsigned int> taken_by_ = 0; ///< 1 + the fork generation of who has it
};

} // namespace isospline
