// Waiting for other threads, in a way that can be cancelled.
#pragma once

#include "isospline/util/progress.h"

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace isospline {

/// What one thread at a time may do, for as long as it takes: a mutex whose wait can be cancelled.
class Turn {
public:
    /// Taken by one thread, to the end of its life.
    class Taken {
    public:
        /// Waits until no other has it. Asks `progress`, if any, twenty times a second, and throws Cancelled where that
        /// returns false.
        Taken(Turn& turn, const Progress& progress) : turn_(turn)
        {
            std::unique_lock lock(turn_.mutex_);
            while (turn_.taken_) {
                turn_.freed_.wait_for(lock, std::chrono::milliseconds(50));
                if (!turn_.taken_ || !progress)
                    continue;
                lock.unlock();
                if (!progress(0.0))
                    throw Cancelled();
                lock.lock();
            }
            turn_.taken_ = true;
        }
        ~Taken()
        {
            {
                const std::lock_guard lock(turn_.mutex_);
                turn_.taken_ = false;
            }
            turn_.freed_.notify_one();
        }
        Taken(const Taken&) = delete;
        Taken& operator=(const Taken&) = delete;

    private:
        Turn& turn_;
    };

private:
    std::mutex mutex_;
    std::condition_variable freed_;
    bool taken_ = false;
};

} // namespace isospline
