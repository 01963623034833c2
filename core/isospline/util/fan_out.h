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
///
/// Tasks know a FanOut by an address, as they must not read anything before they have begun: its own, or one that it is
/// given where tasks do not know its own.
class FanOut {
public:
    FanOut(const FanOut&) = delete;
    FanOut& operator=(const FanOut&) = delete;

#ifdef ISOSPLINE_THREAD_SANITIZER
    FanOut() : FanOut(this)
    {
    }
    explicit FanOut(const void* address) : address_(address)
    {
        __tsan_release(begin_of(address));
    }
    ~FanOut()
    {
        __tsan_acquire(end_of(address_));
    }

    /// Lives while one of the tasks runs.
    class Task {
    public:
        explicit Task(const FanOut& fan_out) : Task(&fan_out) {}
        explicit Task(const void* address) : address_(address) { __tsan_acquire(begin_of(address_)); }
        ~Task() { __tsan_release(end_of(address_)); }
        Task(const Task&) = delete;
        Task& operator=(const Task&) = delete;

    private:
        const void* address_;
    };

private:
    static char* begin_of(const void* address)
    {
        return static_cast<char*>(const_cast<void*>(address));
    }
    static char* end_of(const void* address)
    {
        return begin_of(address) + 1;
    }

    const void* address_;
#else
    FanOut()
    {
    }
    explicit FanOut(const void*)
    {
    }
    ~FanOut()
    {
    }

    struct Task {
        explicit Task(const FanOut&) {}
        explicit Task(const void*) {}
        ~Task() {}
    };
#endif
};

} // namespace isospline
