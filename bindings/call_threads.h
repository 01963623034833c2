// The threads that long calls run on.
#pragma once

#include <functional>
#include <future>

namespace isospline {

/// Runs an operation on a thread that is not the caller's and that has no other operation meanwhile. Threads are kept
/// for later calls, as TBB and Embree keep memory for each that they have ever seen.
std::future<void> run_on_call_thread(std::function<void()> operation);

} // namespace isospline
