#include "isospline/scene/device.h"

#include "isospline/util/fork.h"
#include "isospline/util/lazy.h"
#include "isospline/util/tbb_tasks.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

namespace isospline {

namespace {

/// The counter that this thread's allocations are added to, or null.
thread_local constinit std::atomic<std::ptrdiff_t>* current_count = nullptr;

/// The first error that Embree has reported on this thread. Storing it does not allocate.
struct Error {
    RTCError code;
    char message[256];
};
thread_local constinit Error current_error{RTC_ERROR_NONE, {}};

void keep_error(void*, RTCError code, const char* message) noexcept
{
    if (current_error.code != RTC_ERROR_NONE)
        return;
    current_error.code = code;
    std::strncpy(current_error.message, message != nullptr ? message : "", sizeof(current_error.message) - 1);
}

bool count_bytes(void*, ssize_t bytes, bool) noexcept
{
    if (current_count != nullptr)
        current_count->fetch_add(bytes, std::memory_order_relaxed);
    return true;
}

/// Passes Embree's progress reports to a Progress. No exception may cross Embree's frames, so an exception of the
/// callback is stored and thrown later.
struct Monitor {
    const Progress& progress;
    std::mutex mutex;
    std::exception_ptr raised;
    std::atomic<bool> cancelled = false;

    static bool report(void* monitor, double fraction) noexcept
    {
        auto& self = *static_cast<Monitor*>(monitor);
        const std::lock_guard lock(self.mutex);
        try {
            self.cancelled = self.cancelled || !self.progress(fraction);
        } catch (...) {
            self.raised = std::current_exception();
            self.cancelled = true;
        }
        return !self.cancelled;
    }
};

} // namespace

EmbreeMemory::EmbreeMemory() : before_(std::exchange(current_count, &count_))
{
}

EmbreeMemory::~EmbreeMemory()
{
    current_count = before_;
}

std::size_t EmbreeMemory::bytes() const
{
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(count_, 0));
}

Device& Device::shared()
{
    static auto& device = *new Lazy<std::unique_ptr<Device>>; // never destroyed: threads use it until the process ends
    return *device.get({}, [] {
        const InsideTbb inside_tbb;
        return std::unique_ptr<Device>(new Device);
    });
}

Device::Device() : device_(rtcNewDevice(std::getenv("ISOSPLINE_EMBREE")))
{
    if (!device_) {
        const RTCError error = rtcGetDeviceError(nullptr);
        throw std::runtime_error("Embree cannot create a device: " +
                                 (error == RTC_ERROR_UNSUPPORTED_CPU
                                      ? std::string("the processor does not have the instructions that it asks for")
                                      : "error " + std::to_string(error)));
    }
    packet_size_ = embree::native_packet_size(device_.get());
    rtcSetDeviceErrorFunction(device_.get(), keep_error, nullptr);
    rtcSetDeviceMemoryMonitorFunction(device_.get(), count_bytes, nullptr);
}

void Device::commit(RTCScene scene, const Progress& progress) const
{
    run(progress, [scene](void* monitor) {
        if (monitor != nullptr)
            rtcSetSceneProgressMonitorFunction(scene, Monitor::report, monitor);
        rtcCommitScene(scene);
        rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
    });
}

void* Device::build(RTCBuildArguments arguments, const Progress& progress) const
{
    void* root = nullptr;
    run(progress, [&](void* monitor) {
        arguments.buildProgress = monitor != nullptr ? Monitor::report : nullptr;
        arguments.userPtr = monitor;
        root = rtcBuildBVH(&arguments);
    });
    return root;
}

void Device::throw_if_cancelled(void* user_pointer)
{
    if (user_pointer != nullptr && static_cast<Monitor*>(user_pointer)->cancelled)
        throw Cancelled();
}

void Device::run(const Progress& progress, const std::function<void(void* monitor)>& work) const
{
    check();
    Monitor monitor{progress, {}, {}, false};
    const auto count_for_caller = [count = current_count](const std::function<void()>& help) {
        const auto before = std::exchange(current_count, count);
        help();
        current_count = before;
    };
    run_tbb_tasks([&] { work(progress ? &monitor : nullptr); }, count_for_caller);

    if (monitor.cancelled) {
        current_error.code = RTC_ERROR_NONE;
        if (monitor.raised)
            std::rethrow_exception(monitor.raised);
        throw Cancelled();
    }
    check();
}

void Device::forget_errors() const
{
    current_error.code = RTC_ERROR_NONE;
}

void Device::check() const
{
    const RTCError code = std::exchange(current_error.code, RTC_ERROR_NONE);
    if (code == RTC_ERROR_OUT_OF_MEMORY)
        throw std::bad_alloc();
    if (code != RTC_ERROR_NONE)
        throw std::runtime_error(std::string("Embree: ") + current_error.message);
}

} // namespace isospline
