// Tasks that no call waits for.
#pragma once

#include "isospline/util/progress.h"

#include <functional>

namespace isospline {

/// Begins to call `task(progress)` on another thread. The task may not throw. When `progress` returns false, the task
/// returns within milliseconds: the process is being forked or ends, and waits for the task. Returns false, and does
/// not call the task, if the process is being forked or ends now. Throws std::system_error if the system has no more
/// threads.
bool run_in_background(std::function<void(const Progress&)> task);

/// For the handlers of a fork (util/fork.cpp): makes all tasks stop, waits for them, and lets no new ones begin.
void stop_background_tasks();
/// Lets tasks begin again, in the parent.
void allow_background_tasks();
/// The same in the child, which does not have the threads of its parent.
void allow_background_tasks_in_child();

} // namespace isospline
