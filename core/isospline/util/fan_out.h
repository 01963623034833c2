// Where one thread hands work to others through a library, told to ThreadSanitizer.
#pragma once

#if defined(__SANITIZE_THREAD__)
#define ISOSPLINE_THREAD_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define ISOSPLINE_THREAD_SANITIZER 1
#endif
#endif

#ifdef ISOSPLINE_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace isospline {

/// What happens before a FanOut's life begins happens before all of its tasks, and these before what follows its life.
///
/// TBB and Embree see to that, but ThreadSanitizer cannot see it in libraries that are built without it. It is told
/// nothing about the order of two tasks, so that it still finds races between them. Costs nothing in other builds.
class FanOut {
public:
    FanOut(const FanOut&) = delete;
    FanOut& operator=(const FanOut&) = delete;

#ifdef ISOSPLINE_THREAD_SANITIZER
    FanOut()
    {
        __tsan_release(&begin_);
    }
    ~FanOut()
    {
        __tsan_acquire(&end_);
    }

    /// Lives while one of the tasks runs.
    class Task {
    public:
        explicit Task(FanOut& fan_out) : fan_out_(fan_out) { __tsan_acquire(&fan_out_.begin_); }
        ~Task() { __tsan_release(&fan_out_.end_); }
        Task(const Task&) = delete;
        Task& operator=(const Task&) = delete;

    private:
        FanOut& fan_out_;
    };

private:
    char begin_ = 0, end_ = 0;
#else
    FanOut()
    {
    }
    ~FanOut()
    {
    }

    struct Task {
        explicit Task(FanOut&) {}
        ~Task() {}
    };
#endif
};

} // namespace isospline
