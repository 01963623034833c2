// The threads that long calls run on.
#pragma once

#include <functional>
#include <future>

namespace isospline {

/// Runs an operation on a thread that is not the caller's and that has no other operation meanwhile. Threads are kept
/// for later calls, as TBB and Embree keep memory for each that they have ever seen.
std::future<void> run_on_call_thread(std::function<void()> operation);

/// Whether end_operations() has been called. An operation that asks then cancels itself.
bool process_is_ending();

/// To be called when the interpreter has ended: waits, for two seconds at most, until no operation runs any more, as
/// what they use is about to go.
void end_operations();

} // namespace isospline
