// Forked processes: a child has the memory of its parent's other threads, but not the threads, and must not wait for
// them.
#pragma once

#include <mutex>

namespace isospline {

/// The number of forks between this process and the one that loaded the library.
unsigned int fork_generation();

/// A mutex that is never locked during a fork, for code that reads or swaps a few pointers of the object at `address`.
/// While it is locked, no code may lock another one, wait, read files, or work for long: unrelated objects share it.
std::mutex& fork_safe_mutex(const void* address);

/// The process's one mutex of memory budgets, which is never locked during a fork either. Whoever holds it may work for
/// milliseconds and lock the mutexes above, but not wait or read files.
std::mutex& budget_mutex();

/// An object that lives while a thread of this library is inside of TBB or Embree's builder. A child that is forked
/// meanwhile inherits the locks of these libraries in an unknown state. There, the constructor throws
/// std::runtime_error.
class InsideTbb {
public:
    InsideTbb();
    ~InsideTbb();
    InsideTbb(const InsideTbb&) = delete;
    InsideTbb& operator=(const InsideTbb&) = delete;
};

} // namespace isospline
