// The threads that long calls run on.
#pragma once

#include <functional>
#include <future>

namespace isospline {

/// Runs an operation on another thread, which runs nothing else meanwhile. Threads are reused for later calls, because
/// TBB and Embree keep memory for every thread that they have ever seen.
std::future<void> run_on_call_thread(std::function<void()> operation);

/// Whether end_operations() has been called. Operations that check this then cancel themselves.
bool process_is_ending();

/// Call this when the interpreter has ended. Waits until no operation runs any more, for at most two seconds, because
/// the data that operations use is about to be destroyed.
void end_operations();

} // namespace isospline
