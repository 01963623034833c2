// The global interpreter lock, given up and taken back in a way that outlives the interpreter.
#pragma once

#include "call_threads.h"

#include <pybind11/pybind11.h>

#include <cxxabi.h>
#include <unistd.h>

namespace isospline {

/// Takes the GIL back for a thread that has given it up.
///
/// Until Python 3.14 a thread that asks for the GIL while the interpreter ends is made to exit by pthread_exit, which
/// unwinds its stack as an exception would: through destructors that must not throw, where the process aborts. Such a
/// thread stays here for as long as the process lasts, as Python 3.14 has it.
inline void take_gil(PyThreadState* state) noexcept
{
    if (!process_is_ending()) {
        try {
            return PyEval_RestoreThread(state);
        } catch (abi::__forced_unwind&) { // left by no way
            for (;;)
                pause();
        }
    }
    for (;;)
        pause();
}

/// No GIL for as long as this lives.
class GilReleased {
public:
    GilReleased() : state_(PyEval_SaveThread()) {}
    ~GilReleased() { take_gil(state_); }
    GilReleased(const GilReleased&) = delete;
    GilReleased& operator=(const GilReleased&) = delete;

    /// The GIL again, for as long as that lives.
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
