// Progress and cancellation of long operations.
#pragma once

#include <functional>
#include <stdexcept>

namespace isospline {

/// Called with the finished fraction in [0, 1]; returning false cancels the operation. It is never called from two
/// threads at a time, but may be called from any of them.
using Progress = std::function<bool(double fraction)>;

/// The report of one part of an operation, which takes it from fraction `begin` to fraction `end`; none where
/// `progress` is none. `progress` must outlive it.
inline Progress part_of(const Progress& progress, double begin, double end)
{
    if (!progress)
        return {};
    return [&progress, begin, end](double fraction) { return progress(begin + (end - begin) * fraction); };
}

/// Thrown by an operation whose Progress callback returned false.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled by the progress callback") {}
};

} // namespace isospline
