// Parallel loops over TBB's thread pool.
#pragma once

#include "isospline/util/progress.h"

#include <cstddef>
#include <functional>

namespace isospline {

/// Calls `body(begin, end)` over disjoint chunks of at most `grain` items that cover [0, count), on all threads.
/// Exceptions of the body end the loop and are rethrown. With a `progress` callback, chunks not begun when it returns
/// false are skipped and Cancelled is thrown. A forked process has none of its parent's threads, and runs everything on
/// the calling one.
void parallel_for(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body,
                  const Progress& progress = {});

/// Limits the threads of all parallel loops from now on; 0 means all cores of the machine.
void set_thread_count(int count);

/// The number of threads that a parallel loop may use now.
int thread_count();

} // namespace isospline
