// Tells ThreadSanitizer that one thread hands work to others through a library.
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

/// Work before the construction of a FanOut happens before all of its tasks, and these before work after its
/// destruction.
///
/// TBB and Embree guarantee that, but ThreadSanitizer cannot see it in libraries that are built without it. It is told
/// nothing about the order of two tasks, so it still finds races between them. Other builds are not affected.
///
/// Tasks identify a FanOut by an address, because they must not read anything before they have begun: the FanOut's own
/// address, or a given one if the tasks do not know its own.
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

    /// An object that lives while one of the tasks runs.
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
