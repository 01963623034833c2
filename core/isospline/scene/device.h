// The Embree device: turns its errors into exceptions and counts its memory.
#pragma once

#include "isospline/scene/embree_api.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>

namespace isospline {

/// Counts the bytes that Embree allocates minus those that it frees, on the thread that created this object and on the
/// threads that help it in Device::commit(). If a thread has several such objects, the newest one counts.
class EmbreeMemory {
public:
    EmbreeMemory();
    ~EmbreeMemory();
    EmbreeMemory(const EmbreeMemory&) = delete;
    EmbreeMemory& operator=(const EmbreeMemory&) = delete;

    std::size_t bytes() const;

private:
    std::atomic<std::ptrdiff_t> count_ = 0;
    std::atomic<std::ptrdiff_t>* before_;
};

/// The device that all scenes of a process share, because Embree allows only about a thousand devices. The environment
/// variable ISOSPLINE_EMBREE may hold Embree's configuration, for example isa=avx2. Any number of threads may use the
/// device at the same time.
class Device {
public:
    static Device& shared();

    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    RTCDevice get() const { return device_.get(); }
    /// Rays of a packet: 16, 8 or 4.
    int packet_size() const { return packet_size_; }

    /// Builds a scene's acceleration structure. Throws Cancelled if the progress callback returns false, and
    /// std::runtime_error in a process that was forked while another thread was building.
    void commit(RTCScene scene, const Progress& progress = {}) const;

    /// Builds a tree and returns its root. Sets `buildProgress` and `userPtr`. Throws like commit().
    void* build(RTCBuildArguments arguments, const Progress& progress = {}) const;
    /// Throws Cancelled if the build whose callback has got this user pointer is cancelled. Embree's builder of trees
    /// ignores what the progress callback returns, but ends if another callback throws, as its own code does.
    static void throw_if_cancelled(void* user_pointer);

    /// Clears the errors that Embree has reported on this thread, so that an old error is not taken for a new one.
    void forget_errors() const;

    /// Throws the first error that Embree has reported on this thread since the last call: std::bad_alloc if memory ran
    /// out, otherwise std::runtime_error.
    void check() const;

private:
    Device();

    /// Calls `work(monitor)` on this thread and those that help it. `monitor` is for Embree's progress reports, or
    /// null.
    void run(const Progress& progress, const std::function<void(void* monitor)>& work) const;

    embree::DeviceHandle device_;
    int packet_size_ = 4;
};

} // namespace isospline
