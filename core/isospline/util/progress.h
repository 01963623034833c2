// Progress and cancellation of long operations.
#pragma once

#include <functional>
#include <stdexcept>

namespace isospline {

/// Called with the finished fraction in [0, 1]; returning false cancels the operation. It is never called from two
/// threads at a time, but may be called from any of them.
using Progress = std::function<bool(double fraction)>;

/// Thrown by an operation whose Progress callback returned false.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled by the progress callback") {}
};

} // namespace isospline
