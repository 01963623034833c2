#include "isospline/util/background.h"

#include "catch.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

void pause_for(int milliseconds)
{
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

/// Waits for a busy machine too.
bool becomes_true(const std::atomic<bool>& value)
{
    for (int i = 0; i < 30'000 && !value; ++i)
        pause_for(1);
    return value;
}

/// Runs a task in the background and waits for its end.
bool can_run_tasks()
{
    const auto ran = std::make_shared<std::atomic<bool>>(false);
    return run_in_background([ran](const Progress&) { *ran = true; }) && becomes_true(*ran);
}

/// The exit status of a child that calls `live`; it is killed if that takes too long.
template <typename Live>
int status_of_child(const Live& live)
{
    const pid_t child = fork();
    if (child == 0) {
        alarm(60);
        _exit(live() ? 0 : 1);
    }
    int status = -1;
    REQUIRE(waitpid(child, &status, 0) == child);
    return status;
}

} // namespace

TEST_CASE("tasks run at the same time, on threads that get no signals", "[util][threads]")
{
    std::fesetround(FE_UPWARD);
    std::atomic<int> begun = 0, right = 0, finished = 0;
    for (int i = 0; i < 3; ++i)
        REQUIRE(run_in_background([&](const Progress& progress) {
            ++begun;
            while (begun < 3 && progress(0.0)) // all three are needed
                std::this_thread::yield();
            sigset_t blocked;
            pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
            right += sigismember(&blocked, SIGINT) == 1 && std::fegetround() == FE_TONEAREST;
            ++finished;
        }));
    std::fesetround(FE_TONEAREST);
    for (int i = 0; i < 30'000 && finished < 3; ++i)
        pause_for(1);
    REQUIRE(begun == 3);
    REQUIRE(right == 3);
}

TEST_CASE("a fork stops tasks, and both processes can run others", "[util][threads]")
{
    std::atomic<bool> begun = false, stopped = false;
    REQUIRE(run_in_background([&](const Progress& progress) {
        begun = true;
        while (progress(0.0))
            pause_for(1);
        stopped = true;
    }));
    REQUIRE(becomes_true(begun));
    REQUIRE(!stopped);
    REQUIRE(status_of_child([&] { return stopped && can_run_tasks(); }) == 0);
    REQUIRE(can_run_tasks());
}

TEST_CASE("a process can be forked while other threads begin tasks", "[util][threads]")
{
    std::atomic<bool> end = false;
    std::atomic<int> begun = 0, ended = 0;
    std::vector<std::thread> others;
    for (int i = 0; i < 3; ++i)
        others.emplace_back([&] {
            while (!end) {
                std::atomic<bool> has_ended = false;
                if (!run_in_background([&](const Progress&) { has_ended = true; }))
                    continue;
                ++begun;
                while (!has_ended)
                    std::this_thread::yield();
                ++ended;
            }
        });
    for (int i = 0; i < 200; ++i)
        REQUIRE(status_of_child([&] {
                    // A task that began but does not exist here would be waited for by this fork.
                    return can_run_tasks() && status_of_child(can_run_tasks) == 0;
                }) == 0);
    end = true;
    for (std::thread& other : others)
        other.join();
    REQUIRE(begun > 0);
    REQUIRE(ended == begun);
}
