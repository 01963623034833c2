// The Embree device, whose errors are exceptions and whose memory is counted.
#pragma once

#include "isospline/scene/embree_api.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <cstddef>
#include <memory>

namespace isospline {

/// Counts what Embree allocates, less what it frees, for the thread that this lives on and for the threads that build
/// for it in Device::commit(). Of two that live on one thread, the younger counts.
class EmbreeMemory {
public:
    EmbreeMemory();
    ~EmbreeMemory();
    EmbreeMemory(const EmbreeMemory&) = delete;
    EmbreeMemory& operator=(const EmbreeMemory&) = delete;

    std::size_t bytes() const;

private:
    std::shared_ptr<std::atomic<std::ptrdiff_t>> count_, before_;
};

/// The device that all scenes of a process share, as Embree has room for a thousand at most. The environment variable
/// ISOSPLINE_EMBREE may hold Embree's configuration, such as isa=avx2. Any number of threads may use it at a time.
class Device {
public:
    static Device& shared();

    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    RTCDevice get() const { return device_.get(); }
    /// Rays of a packet: 16, 8 or 4.
    int packet_size() const { return packet_size_; }

    /// Builds a scene's acceleration structure. Throws Cancelled where the progress callback returns false.
    void commit(RTCScene scene, const Progress& progress = {}) const;

    /// Forgets what Embree has reported on this thread: an error that nobody asked for is not the next one's.
    void forget_errors() const;

    /// Throws what Embree has reported on this thread since the last call: std::bad_alloc where memory ran out, else
    /// std::runtime_error.
    void check() const;

private:
    Device();

    embree::DeviceHandle device_;
    int packet_size_ = 4;
};

} // namespace isospline
