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

namespace isospline {

/// Runs `operation(progress)` on another thread, without the GIL, while the calling thread wakes up twenty times
/// a second to deliver signals and to call the Python callable `report(fraction)`, or none where it is None. The
/// callable is called before the operation starts, too. A signal handler or a callable that raises, and a callable that
/// returns a false value other than None, cancel the operation; what was raised is raised again once the operation has
/// ended.
template <typename Operation>
void long_call(const pybind11::object& report, Operation operation)
{
    namespace py = pybind11;
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
            done = running.wait_for(std::chrono::milliseconds(50)) == std::future_status::ready;
            if (!cancelled)
                deliver();
        }
        try {
            running.get();
        } catch (const Cancelled&) {
            if (!raised)
                throw;
        }
    }
    if (raised)
        std::rethrow_exception(raised);
}

} // namespace isospline
