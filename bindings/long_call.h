// Long operations called from Python: the GIL released, progress reported, Ctrl-C obeyed.
#pragma once

#include "call_threads.h"
#include "gil.h"

#include "isospline/util/progress.h"

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <new>
#include <string>

namespace isospline {

/// Out of memory, and what for; becomes a MemoryError.
class OutOfMemory : public std::bad_alloc {
public:
    explicit OutOfMemory(const std::string& what_for) : message_("out of memory: " + what_for) {}
    const char* what() const noexcept override { return message_.c_str(); }

private:
    std::string message_;
};

/// `operation()`, whose failing allocations tell what they were for, such as "to render 64 x 48 pixels".
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

/// Runs `operation(progress)` on another thread, without the GIL, while the calling thread wakes up a hundred times
/// a second to deliver signals and to call the Python callable `progress(fraction)`, or none where it is None; True
/// stands for a bar on standard error. The callable is called before the operation starts, too. A signal handler or a
/// callable that raises, and a callable that returns a false value other than None, cancel the operation; what was
/// raised is raised again once the operation has ended. Where memory runs out, the error tells `what_for`.
template <typename Operation>
void long_call(const std::string& what_for, const pybind11::object& progress, Operation operation)
{
    namespace py = pybind11;
    const py::object report =
        progress.is_none() ? progress : py::module_::import("isospline.progress").attr("as_callable")(progress);
    std::atomic<bool> cancelled = false;
    std::atomic<double> finished = 0.0;
    std::exception_ptr raised;
    const auto tell = [&] {
        if (report.is_none())
            return;
        const py::object go_on = report(finished.load());
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
                finished = fraction;
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
