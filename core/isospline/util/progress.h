// Progress and cancellation of long operations.
#pragma once

#include <functional>
#include <stdexcept>

namespace isospline {

/// Called with the finished fraction in [0, 1]; returning false cancels the operation. It is never called from two
/// threads at a time, but may be called from any of them.
using Progress = std::function<bool(double fraction)>;

/// A callback for one part of an operation, from fraction `begin` to fraction `end`; empty if `progress` is empty.
/// `progress` must outlive it.
inline Progress part_of(const Progress& progress, double begin, double end)
{
    if (!progress)
        return {};
    return [&progress, begin, end](double fraction) { return progress(begin + (end - begin) * fraction); };
}

/// A callback for what an operation makes on its way, which only asks whether to go on. `progress` must outlive it.
inline Progress only_cancelling(const Progress& progress)
{
    if (!progress)
        return {};
    return [&progress](double) { return progress(0.0); };
}

/// Thrown by an operation whose Progress callback returned false.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled by the progress callback") {}
};

/// Reports a fraction if there is a callback, and throws Cancelled if the callback returns false.
inline void report(const Progress& progress, double fraction)
{
    if (progress && !progress(fraction))
        throw Cancelled();
}

} // namespace isospline
