#include "isospline/scene/device.h"

#include "isospline/util/fan_out.h"
#include "isospline/util/fork.h"
#include "isospline/util/turn.h"

#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace isospline {

namespace {

using Count = std::shared_ptr<std::atomic<std::ptrdiff_t>>;

/// The counter that this thread's allocations are added to.
thread_local Count current_count;

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
    if (current_count)
        current_count->fetch_add(bytes, std::memory_order_relaxed);
    return true;
}

/// The threads of one commit work in an arena of their own, so that their allocations can be counted.
class BuildArena : public tbb::task_arena, public tbb::task_scheduler_observer {
public:
    BuildArena() : tbb::task_scheduler_observer(static_cast<tbb::task_arena&>(*this)) { observe(true); }
    ~BuildArena() override { observe(false); }

    void on_scheduler_entry(bool is_worker) override
    {
        const FanOut::Task task(this);
        if (is_worker)
            current_count = count_;
    }
    void on_scheduler_exit(bool is_worker) override
    {
        if (is_worker)
            current_count = nullptr;
    }

    /// Bytes that the helping threads have allocated since the last call.
    std::ptrdiff_t take_count() { return count_->exchange(0); }

private:
    Count count_ = std::make_shared<std::atomic<std::ptrdiff_t>>(0);
};

/// Arenas that no commit uses now. They are reused, because TBB keeps memory for every arena that was ever made.
class IdleArenas {
public:
    static IdleArenas& instance()
    {
        static auto& idle = *new IdleArenas; // never destroyed: threads may use it until the process ends
        return idle;
    }

    std::unique_ptr<BuildArena> take()
    {
        {
            const std::lock_guard lock(moment_mutex(this));
            if (generation_ != fork_generation()) {
                // The threads registered there do not exist in this process.
                for (auto& arena : arenas_)
                    static_cast<void>(arena.release());
                arenas_.clear();
                generation_ = fork_generation();
            }
            if (!arenas_.empty()) {
                auto arena = std::move(arenas_.back());
                arenas_.pop_back();
                return arena;
            }
        }
        return std::make_unique<BuildArena>();
    }

    void give_back(std::unique_ptr<BuildArena> arena)
    {
        const std::lock_guard lock(moment_mutex(this));
        arenas_.push_back(std::move(arena));
    }

private:
    unsigned int generation_ = 0;
    std::vector<std::unique_ptr<BuildArena>> arenas_;
};

/// Passes Embree's progress reports to a Progress. No exception may cross Embree's frames, so an exception of the
/// callback is stored and thrown later.
struct Monitor {
    const Progress& progress;
    std::mutex mutex;
    std::exception_ptr raised;
    bool cancelled = false;

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

/// Throws if threads that do not exist in this process may hold Embree's locks.
void check_fork()
{
    if (!is_whole_after_fork())
        throw std::runtime_error("this process was forked while another thread was at work in isospline: it cannot "
                                 "build scenes; fork while no call is running, or start processes with \"spawn\"");
}

} // namespace

EmbreeMemory::EmbreeMemory()
    : count_(std::make_shared<std::atomic<std::ptrdiff_t>>(0)), before_(std::exchange(current_count, count_))
{
}

EmbreeMemory::~EmbreeMemory()
{
    current_count = std::move(before_);
}

std::size_t EmbreeMemory::bytes() const
{
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(*count_, 0));
}

Device& Device::shared()
{
    static std::atomic<Device*> device = nullptr; // never destroyed: threads may use it until the process ends
    if (Device* const known = device)
        return *known;
    static Turn turn;
    const Turn::Taken taken(turn, {});
    if (device == nullptr) {
        check_fork();
        const InParallel in_parallel;
        device = new Device;
    }
    return *device;
}

Device::Device() : device_(rtcNewDevice(std::getenv("ISOSPLINE_EMBREE")))
{
    if (!device_)
        throw std::runtime_error("Embree cannot create a device: error " + std::to_string(rtcGetDeviceError(nullptr)));
    packet_size_ = embree::native_packet_size(device_.get());
    rtcSetDeviceErrorFunction(device_.get(), keep_error, nullptr);
    rtcSetDeviceMemoryMonitorFunction(device_.get(), count_bytes, nullptr);
}

void Device::commit(RTCScene scene, const Progress& progress) const
{
    check();
    check_fork();
    const InParallel in_parallel;
    Monitor monitor{progress, {}, {}, false};
    if (progress)
        rtcSetSceneProgressMonitorFunction(scene, Monitor::report, &monitor);
    auto arena = IdleArenas::instance().take();
    const FanOut fan_out(static_cast<const void*>(arena.get()));
    arena->execute([&] { rtcCommitScene(scene); });
    if (const std::ptrdiff_t by_helpers = arena->take_count(); current_count)
        current_count->fetch_add(by_helpers, std::memory_order_relaxed);
    IdleArenas::instance().give_back(std::move(arena));
    rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);

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
