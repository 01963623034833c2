// An Embree device whose errors are exceptions and whose memory is counted.
#pragma once

#include "isospline/scene/build_quality.h"
#include "isospline/scene/embree_api.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <cstddef>
#include <mutex>
#include <string>

namespace isospline {

/// A device of its own for every Scene, so that memory() is that of the scene. The environment variable
/// ISOSPLINE_EMBREE may hold Embree's configuration, such as isa=avx2.
class Device {
public:
    explicit Device(BuildQuality quality);
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    RTCDevice get() const { return device_.get(); }
    /// Rays of a packet: 16, 8 or 4.
    int packet_size() const { return packet_size_; }
    RTCBuildQuality build_quality() const { return build_quality_; }

    /// Builds a scene's acceleration structure. Throws Cancelled where the progress callback returns false.
    void commit(RTCScene scene, const Progress& progress = {});

    /// Throws what Embree has reported since the last call: std::bad_alloc where memory ran out, else
    /// std::runtime_error.
    void check();

    /// Bytes that Embree holds for this device.
    std::size_t memory() const { return static_cast<std::size_t>(memory_.load()); }

private:
    std::mutex error_mutex_;
    RTCError error_ = RTC_ERROR_NONE;
    std::string error_message_;
    std::atomic<std::ptrdiff_t> memory_ = 0;
    int packet_size_ = 4;
    RTCBuildQuality build_quality_;
    embree::DeviceHandle device_; // last: released first, while the members that it reports to still live
};

} // namespace isospline
