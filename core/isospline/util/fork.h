// What a forked process must not wait for: it has the memory of its parent's other threads, but not the threads.
#pragma once

#include <mutex>

namespace isospline {

/// How many forks lie between this process and the one that loaded the library.
unsigned int fork_generation();

/// A mutex that no fork finds locked, for code that reads or swaps a few pointers of the object at `address`. Nobody
/// may lock another one, wait or work for long while it is locked: unrelated objects share it.
std::mutex& moment_mutex(const void* address);

/// Lives while threads of TBB or Embree work for the caller. A fork meanwhile leaves the locks of these libraries to
/// the child as they are.
class InParallel {
public:
    InParallel();
    ~InParallel();
    InParallel(const InParallel&) = delete;
    InParallel& operator=(const InParallel&) = delete;
};

/// Whether TBB has the threads that it thinks it has: false in a child whose parent has used them.
bool has_worker_threads();

/// Whether TBB and Embree can be called: false in a child whose parent was working with them when it was forked.
bool is_whole_after_fork();

} // namespace isospline
