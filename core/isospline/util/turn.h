// Waiting for other threads with the possibility to cancel.
#pragma once

#include "isospline/util/fork.h"
#include "isospline/util/progress.h"

#include <chrono>
#include <thread>

namespace isospline {

/// A mutex for long operations, whose wait can be cancelled. A forked process takes the mutex over if a thread of its
/// parent held it, because that thread does not exist in the child.
class Turn {
public:
    /// Holds the turn for one thread as long as it lives.
    class Taken {
    public:
        /// Waits until no other thread holds it. Meanwhile it calls `progress`, if any, repeatedly, and throws
        /// Cancelled if that returns false.
        Taken(Turn& turn, const Progress& progress) : turn_(turn)
        {
            for (;;) {
                const TakeoverMutex::Attempt attempt = turn_.mutex_.attempt();
                if (attempt != TakeoverMutex::Attempt::failed) {
                    was_abandoned_ = attempt == TakeoverMutex::Attempt::taken_over;
                    return;
                }
                report(progress, 0.0);
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
        ~Taken() { turn_.mutex_.unlock(); }
        Taken(const Taken&) = delete;
        Taken& operator=(const Taken&) = delete;

        /// Whether the previous thread had not finished when this process was forked.
        bool was_abandoned() const { return was_abandoned_; }

    private:
        Turn& turn_;
        bool was_abandoned_ = false;
    };

private:
    TakeoverMutex mutex_;
};

} // namespace isospline
