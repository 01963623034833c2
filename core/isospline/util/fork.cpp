#include "isospline/util/fork.h"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <pthread.h>
#include <unistd.h>

namespace isospline {

namespace {

std::mutex the_operation_mutex;
std::array<std::mutex, 32> moment_mutexes;
std::atomic<unsigned int> generation = 0;
std::atomic<int> in_parallel = 0;
std::atomic<bool> workers_were_started = false, workers_are_lost = false, is_whole = true;

/// Whether all other threads of the process sleep, and so hold none of the spin locks of TBB and Embree. The workers of
/// these libraries run on for a while after the end of a loop.
bool others_sleep()
{
    const std::string self = std::to_string(gettid());
    std::error_code error;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
        if (task.path().filename() == self)
            continue;
        std::ifstream file(task.path() / "stat");
        std::string line;
        std::getline(file, line);
        const std::size_t name_end = line.rfind(')');
        if (name_end != std::string::npos && name_end + 2 < line.size() && line[name_end + 2] != 'S')
            return false;
    }
    return !error;
}

bool is_quiet = true; ///< for the fork in progress

/// Milliseconds that a fork waits for idle workers to fall asleep. A few are enough on a quiet machine; on a busy one,
/// the workers first have to wait for a core.
constexpr int longest_wait = 1000;

void before_fork()
{
    is_quiet = !workers_were_started;
    for (int i = 0; i < longest_wait && !is_quiet && in_parallel == 0; ++i) {
        is_quiet = others_sleep() && in_parallel == 0;
        if (!is_quiet)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    the_operation_mutex.lock();
    for (std::mutex& mutex : moment_mutexes)
        mutex.lock();
}

void after_fork()
{
    for (std::mutex& mutex : moment_mutexes)
        mutex.unlock();
    the_operation_mutex.unlock();
}

void in_child()
{
    ++generation;
    workers_are_lost = workers_are_lost || workers_were_started;
    is_whole = is_whole && is_quiet;
    in_parallel = 0;
    after_fork();
}

[[maybe_unused]] const int registered = pthread_atfork(before_fork, after_fork, in_child);

} // namespace

unsigned int fork_generation()
{
    return generation;
}

std::mutex& moment_mutex(const void* address)
{
    // Objects are larger than 64 bytes, so the last six bits of their addresses do not distinguish them.
    return moment_mutexes[(reinterpret_cast<std::uintptr_t>(address) >> 6) % moment_mutexes.size()];
}

std::mutex& operation_mutex()
{
    return the_operation_mutex;
}

InParallel::InParallel()
{
    ++in_parallel;
    workers_were_started = true;
}

InParallel::~InParallel()
{
    --in_parallel;
}

bool has_worker_threads()
{
    return !workers_are_lost;
}

bool is_whole_after_fork()
{
    return is_whole;
}

} // namespace isospline
