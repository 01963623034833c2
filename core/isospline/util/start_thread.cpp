#include "isospline/util/start_thread.h"

#include <pthread.h>
#include <signal.h>

#include <cfenv>
#include <system_error>
#include <thread>
#include <utility>

namespace isospline {

namespace {

/// A new thread blocks the signals that its creator blocks.
class SignalsBlocked {
public:
    SignalsBlocked()
    {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

private:
    sigset_t before_;
};

} // namespace

void start_thread(std::function<void()> run)
{
    const SignalsBlocked blocked;
    try {
        std::thread([run = std::move(run)] {
            std::fesetenv(FE_DFL_ENV); // not that of the thread that happened to start this one
            run();
        }).detach();
    } catch (const std::system_error& error) {
        throw std::system_error(error.code(), "cannot start a thread: out of memory, or at the limit of threads");
    }
}

} // namespace isospline
