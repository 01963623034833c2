// Releases and takes the global interpreter lock, safely even when the interpreter ends.
#pragma once

#include "call_threads.h"

#include <pybind11/pybind11.h>

#include <cxxabi.h>
#include <unistd.h>

namespace isospline {

/// Takes the GIL back for a thread that has released it.
///
/// Before Python 3.14, a thread that requests the GIL while the interpreter ends exits by pthread_exit. This unwinds
/// its stack like an exception, and the process aborts in destructors that must not throw. Instead, such a thread stays
/// here until the process ends, as in Python 3.14.
inline void take_gil(PyThreadState* state) noexcept
{
    if (!process_is_ending()) {
        try {
            return PyEval_RestoreThread(state);
        } catch (abi::__forced_unwind&) { // never returns
            for (;;)
                pause();
        }
    }
    for (;;)
        pause();
}

/// The thread does not hold the GIL while this object lives.
class GilReleased {
public:
    GilReleased() : state_(PyEval_SaveThread()) {}
    ~GilReleased() { take_gil(state_); }
    GilReleased(const GilReleased&) = delete;
    GilReleased& operator=(const GilReleased&) = delete;

    /// The thread holds the GIL again while this object lives.
    class Taken {
    public:
        explicit Taken(GilReleased& released) : released_(released) { take_gil(released_.state_); }
        ~Taken() { released_.state_ = PyEval_SaveThread(); }
        Taken(const Taken&) = delete;
        Taken& operator=(const Taken&) = delete;

    private:
        GilReleased& released_;
    };

private:
    PyThreadState* state_;
};

} // namespace isospline
