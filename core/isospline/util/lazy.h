// Values that are computed when they are first needed.
#pragma once

#include "isospline/util/cancellable_mutex.h"
#include "isospline/util/progress.h"

#include <atomic>

namespace isospline {

/// A value that the first call computes, while other threads that need it wait. If the computation throws, the next
/// call computes it.
template <typename Value>
class Lazy {
public:
    Lazy() = default;
    Lazy(const Lazy&) = delete;
    Lazy& operator=(const Lazy&) = delete;
    ~Lazy() { delete found_.load(); }

    /// The value, which `find()` returns. Throws Cancelled if `progress` returns false during the wait.
    template <typename Find>
    const Value& get(const Progress& progress, const Find& find)
    {
        if (const Value* const value = found_)
            return *value;
        const CancellableMutex::Lock lock(mutex_, progress);
        if (found_ == nullptr)
            found_ = new Value(find());
        return *found_;
    }

    /// The value, or null if it is not computed yet.
    const Value* found() const { return found_; }

private:
    CancellableMutex mutex_;
    std::atomic<const Value*> found_ = nullptr; ///< set in one step, so that a forked process never sees a part of it
};

} // namespace isospline
