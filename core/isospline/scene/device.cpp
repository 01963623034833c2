#include "isospline/scene/device.h"

#include <cstdlib>
#include <exception>
#include <new>
#include <stdexcept>

namespace isospline {

Device::Device(BuildQuality quality)
    : build_quality_(quality == BuildQuality::low    ? RTC_BUILD_QUALITY_LOW
                     : quality == BuildQuality::high ? RTC_BUILD_QUALITY_HIGH
                                                     : RTC_BUILD_QUALITY_MEDIUM),
      device_(rtcNewDevice(std::getenv("ISOSPLINE_EMBREE")))
{
    if (!device_)
        throw std::runtime_error("Embree cannot create a device: error " + std::to_string(rtcGetDeviceError(nullptr)));
    packet_size_ = embree::native_packet_size(device_.get());
    rtcSetDeviceErrorFunction(
        device_.get(),
        [](void* self, RTCError code, const char* message) {
            auto& device = *static_cast<Device*>(self);
            const std::lock_guard lock(device.error_mutex_);
            device.error_ = code;
            device.error_message_ = message ? message : "";
        },
        this);
    rtcSetDeviceMemoryMonitorFunction(
        device_.get(),
        [](void* self, ssize_t bytes, bool) {
            static_cast<Device*>(self)->memory_ += bytes;
            return true;
        },
        this);
}

void Device::commit(RTCScene scene, const Progress& progress)
{
    // No exception may cross Embree's frames: what the callback throws is carried around them.
    struct Monitor {
        const Progress& progress;
        std::mutex mutex;
        std::exception_ptr raised;
        bool cancelled = false;
    } monitor{progress, {}, {}, false};
    if (progress)
        rtcSetSceneProgressMonitorFunction(
            scene,
            [](void* pointer, double fraction) {
                auto& self = *static_cast<Monitor*>(pointer);
                const std::lock_guard lock(self.mutex);
                try {
                    self.cancelled = self.cancelled || !self.progress(fraction);
                } catch (...) {
                    self.raised = std::current_exception();
                    self.cancelled = true;
                }
                return !self.cancelled;
            },
            &monitor);
    rtcCommitScene(scene);
    rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);

    if (monitor.cancelled) {
        const std::lock_guard lock(error_mutex_);
        error_ = RTC_ERROR_NONE;
        if (monitor.raised)
            std::rethrow_exception(monitor.raised);
        throw Cancelled();
    }
    check();
}

void Device::check()
{
    const std::lock_guard lock(error_mutex_);
    const RTCError error = error_;
    error_ = RTC_ERROR_NONE;
    if (error == RTC_ERROR_OUT_OF_MEMORY)
        throw std::bad_alloc();
    if (error != RTC_ERROR_NONE)
        throw std::runtime_error("Embree: " + error_message_);
}

} // namespace isospline
