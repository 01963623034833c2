// Parallel loops.
#pragma once

#include "isospline/util/progress.h"
#include "isospline/util/thread_pool.h"

#include <cstddef>
#include <functional>

namespace isospline {

/// Calls `body(begin, end)` over disjoint chunks of at most `grain` items that cover [0, count), on the calling thread
/// and on threads of the pool. The first exception of the body ends the loop and is rethrown. With a `progress`
/// callback, chunks not begun when it returns false are skipped and Cancelled is thrown.
void parallel_for(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body,
                  const Progress& progress = {});

} // namespace isospline
