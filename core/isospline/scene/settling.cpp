#include "isospline/scene/settling.h"

#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <unordered_map>
#include <utility>

namespace isospline {

namespace {

/// Tasks that run now, and the number of times that all tasks were told to stop.
std::atomic<unsigned int> running = 0, stops = 0;

/// Tasks hear of it within milliseconds: between chunks of work, and from Embree's builder.
void stop_all()
{
    ++stops;
    while (running != 0)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
}

/// Handlers of fork() run in the reverse order of their registration, so this one runs before those of the libraries
/// that tasks use.
void register_handlers()
{
    static const bool registered = [] {
        pthread_atfork(stop_all, nullptr, nullptr);
        std::atexit(stop_all);
        return true;
    }();
    static_cast<void>(registered);
}

/// Signals go to the threads of the user.
class SignalsBlocked {
public:
    SignalsBlocked()
    {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

private:
    sigset_t before_;
};

} // namespace

Objects settled_objects(const SceneSnapshot::Impl& snapshot, const BuildOptions& options, const Progress& progress)
{
    struct Shape {
        const Object* object;
        double largest_error;
    };
    std::unordered_map<const void*, Shape> shapes; // by the address of the isosurface or mesh
    for (const auto& instance : snapshot.instances) {
        Shape& shape =
            shapes.try_emplace(address(instance->shown.object).get(), Shape{instance->object.get(), 0.0}).first->second;
        shape.largest_error = std::max(shape.largest_error, instance->placement.rounding_error);
    }
    Objects settled;
    for (const auto& [what, shape] : shapes)
        if (const std::shared_ptr<Object> object = shape.object->settled()) {
            object->build(options, shape.largest_error, progress);
            settled.emplace(what, object);
        }
    return settled;
}

struct Settling::Task {
    std::shared_ptr<const SceneSnapshot> snapshot;
    const SceneSnapshot::Impl& impl;
    BuildOptions options;
    unsigned int stops_before;
    std::atomic<bool> is_wanted = true;
    std::atomic<State> state = State::running;
    Objects objects;

    void run() noexcept
    {
        State result = State::failed;
        try {
            objects = settled_objects(impl, options, [this](double) { return is_wanted && stops == stops_before; });
            result = State::done;
        } catch (const Cancelled&) {
            result = State::cancelled;
        } catch (...) { // the draft stays
        }
        snapshot = nullptr;
        state.store(result, std::memory_order_release);
    }
};

Settling::Settling(std::shared_ptr<const SceneSnapshot> snapshot, const SceneSnapshot::Impl& impl,
                   const BuildOptions& options)
    : task_(new Task{std::move(snapshot), impl, options, stops, true, State::running, {}})
{
    register_handlers();
    ++running;
    try {
        const SignalsBlocked blocked;
        std::thread([task = task_]() mutable {
            task->run();
            task = nullptr;
            --running;
        }).detach();
    } catch (...) {
        --running;
        task_->state = State::failed;
    }
}

Settling::~Settling()
{
    task_->is_wanted = false;
}

Settling::State Settling::state() const
{
    return task_->state.load(std::memory_order_acquire);
}

const Objects& Settling::objects() const
{
    return task_->objects;
}

} // namespace isospline
