// Code that makes TBB tasks, run on the threads of this library.
#pragma once

#include <functional>

namespace isospline {

/// Calls `work()`, and runs its TBB tasks on this thread and on threads of the pool. TBB starts no threads of its own
/// for it. `as_helper(help)`, if given, is called on threads that help; it calls `help()`. Throws std::runtime_error in
/// a process that was forked while another thread was in such a call.
void run_tbb_tasks(const std::function<void()>& work,
                   const std::function<void(const std::function<void()>&)>& as_helper = {});

} // namespace isospline
