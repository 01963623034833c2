#include "isospline/util/fork.h"

#include "isospline/util/background.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <stdexcept>

#include <pthread.h>

namespace isospline {

namespace {

std::mutex the_budget_mutex;
std::array<std::mutex, 32> mutexes;
std::atomic<unsigned int> generation = 0;
std::atomic<int> inside_tbb = 0;
std::atomic<bool> tbb_is_lost = false; ///< to this process, which was forked while a thread was inside of TBB

// These handlers run in every fork of the process. They neither allocate nor throw. They wait for background tasks to
// stop, some milliseconds, and for mutexes that are held for moments.

void before_fork()
{
    stop_background_tasks();
    the_budget_mutex.lock();
    for (std::mutex& mutex : mutexes)
        mutex.lock();
}

void unlock_all()
{
    for (std::mutex& mutex : mutexes)
        mutex.unlock();
    the_budget_mutex.unlock();
}

void in_parent()
{
    unlock_all();
    allow_background_tasks();
}

void in_child()
{
    allow_background_tasks_in_child();
    ++generation;
    if (inside_tbb.exchange(0) != 0)
        tbb_is_lost = true;
    unlock_all();
}

[[maybe_unused]] const int has_fork_handlers = pthread_atfork(before_fork, in_parent, in_child);

} // namespace

unsigned int fork_generation()
{
    return generation;
}

std::mutex& fork_safe_mutex(const void* address)
{
    // Objects are larger than 64 bytes, so the last six bits of their addresses do not distinguish them.
    return mutexes[(reinterpret_cast<std::uintptr_t>(address) >> 6) % mutexes.size()];
}

std::mutex& budget_mutex()
{
    return the_budget_mutex;
}

InsideTbb::InsideTbb()
{
    if (tbb_is_lost)
        throw std::runtime_error("this process was forked while another thread was at work in isospline: it cannot "
                                 "build scenes and meshes; fork while no call is running, or start processes with "
                                 "\"spawn\"");
    ++inside_tbb;
}

InsideTbb::~InsideTbb()
{
    --inside_tbb;
}

} // namespace isospline
