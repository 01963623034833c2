// Threads of the library itself.
#pragma once

#include <functional>

namespace isospline {

/// Calls `run()` on a new thread that nobody joins. Signals go to the user's threads, not to this one, and it has the
/// default floating-point environment. Throws std::system_error if the system has no more threads.
void start_thread(std::function<void()> run);

} // namespace isospline
