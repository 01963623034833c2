// Long operations called from Python: they release the GIL, report progress, and obey Ctrl-C.
#pragma once

#include "call_threads.h"
#include "gil.h"
#include "handed.h"

#include "isospline/util/progress.h"

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <new>
#include <string>

namespace isospline {

/// Out of memory, with the purpose of the memory; becomes a MemoryError.
class OutOfMemory : public std::bad_alloc {
public:
    explicit OutOfMemory(const std::string& what_for) : message_("out of memory: " + what_for) {}
    const char* what() const noexcept override { return message_.c_str(); }

private:
    std::string message_;
};

/// Runs `operation()`; a failing allocation is reported with its purpose, such as "to render 64 x 48 pixels".
template <typename Operation>
auto naming_memory(const std::string& what_for, const Operation& operation)
{
    try {
        return operation();
    } catch (const OutOfMemory&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw OutOfMemory(what_for);
    }
}

/// Runs `operation(progress)` on another thread, without the GIL. Meanwhile the calling thread wakes up a hundred times
/// a second to deliver signals and to call the Python callable `progress(fraction)`, unless it is None; True means a
/// progress bar on standard error. The callable is also called before the operation starts. The operation is cancelled
/// if the callable returns a false value other than None, or if it or a signal handler raises; the exception is raised
/// again when the operation has ended. If memory runs out, the error has `what_for`.
template <typename Operation>
void long_call(const std::string& what_for, const pybind11::object& progress, Operation operation)
{
    namespace py = pybind11;
    const py::object report = progress.is_none() ? progress : handed("as_callable")(progress);
    std::atomic<bool> cancelled = false;
    std::atomic<double> finished = 0.0;
    std::exception_ptr raised;
    const auto tell = [&] {
        if (report.is_none())
            return;
        const py::object go_on = call_python(report, py::float_(finished.load()));
        if (!go_on.is_none() && !py::bool_(go_on))
            cancelled = true;
    };
    tell();
    if (cancelled)
        throw Cancelled();

    {
        GilReleased no_gil;
        auto running = run_on_call_thread([&] {
            operation(Progress([&](double fraction) {
                // What was told is not taken back.
                for (double before = finished; fraction > before && !finished.compare_exchange_weak(before, fraction);)
                    ;
                return !cancelled && !process_is_ending();
            }));
        });

        const auto deliver = [&] {
            const GilReleased::Taken gil(no_gil);
            try {
                if (PyErr_CheckSignals() != 0)
                    throw py::error_already_set();
                tell();
            } catch (...) {
                raised = std::current_exception();
                cancelled = true;
            }
        };

        bool done = false;
        while (!done) {
            done = running.wait_for(std::chrono::milliseconds(10)) == std::future_status::ready;
            if (!cancelled)
                deliver();
        }
        try {
            naming_memory(what_for, [&] { running.get(); });
        } catch (const Cancelled&) {
            if (!raised)
                throw;
        }
    }
    if (raised)
        std::rethrow_exception(raised);
}

} // namespace isospline
