// The threads of this library, which help the threads that call it.
#pragma once

#include <functional>

namespace isospline {

/// Calls `work()`, and meanwhile calls `help()` on idle threads of the pool: on at most `most_helpers` of them, and on
/// fewer than thread_count(). Returns when all calls have returned. Neither may throw, and `help` returns soon after
/// `work` has. What happens before this call happens before the calls of both, and these before its return.
void run_with_help(int most_helpers, const std::function<void()>& work, const std::function<void()>& help);

/// Limits the threads that work for a call, from now on; 0 means all cores of the machine.
void set_thread_count(int count);

/// The number of threads that may work for a call now. It is one in a process that was forked after the pool had
/// started threads, because they do not exist there.
int thread_count();

} // namespace isospline
