// Releases and takes the global interpreter lock, safely even when the interpreter ends.
#pragma once

#include "call_threads.h"

#include <pybind11/pybind11.h>

#include <cxxabi.h>
#include <unistd.h>

namespace isospline {

/// Runs `call`, which may request the GIL, as most calls of NumPy and of Python functions do.
///
/// Before Python 3.14, a thread that requests the GIL while the interpreter ends exits by pthread_exit. This unwinds
/// its stack like an exception: destructors release Python objects without the GIL, or abort because they must not
/// throw. Instead, such a thread stays here until the process ends, as in Python 3.14. `call` itself must not hold
/// Python objects of its own.
template <typename Call>
auto stay_at_exit(const Call& call)
{
    try {
        return call();
    } catch (abi::__forced_unwind&) { // never returns
        for (;;)
            pause();
    }
}

/// Returns function(argument).
inline pybind11::object call_python(const pybind11::object& function, const pybind11::object& argument)
{
    PyObject* const result = stay_at_exit([&] { return PyObject_CallOneArg(function.ptr(), argument.ptr()); });
    if (result == nullptr)
        throw pybind11::error_already_set();
    return pybind11::reinterpret_steal<pybind11::object>(result);
}

/// Takes the GIL back for a thread that has released it.
inline void take_gil(PyThreadState* state) noexcept
{
    if (!process_is_ending())
        return stay_at_exit([state] { PyEval_RestoreThread(state); });
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
