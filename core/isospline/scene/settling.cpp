#include "isospline/scene/settling.h"

#include "isospline/util/background.h"

#include <algorithm>
#include <atomic>
#include <unordered_map>
#include <utility>

namespace isospline {

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
    const SceneSnapshot::Impl& snapshot;
    const BuildOptions options;
    std::atomic<bool> is_wanted = true;
    std::atomic<State> state = State::idle;
    Objects objects;

    void run(const Progress& progress) noexcept
    {
        State result = State::failed;
        try {
            objects =
                settled_objects(snapshot, options, [&](double fraction) { return is_wanted && progress(fraction); });
            result = State::done;
        } catch (const Cancelled&) {
            result = State::idle;
        } catch (...) { // the draft stays
        }
        state.store(result, std::memory_order_release);
    }
};

Settling::Settling(const SceneSnapshot::Impl& snapshot, const BuildOptions& options)
    : task_(new Task{snapshot, options, true, State::idle, {}})
{
}

Settling::~Settling()
{
    task_->is_wanted = false;
}

void Settling::begin(std::shared_ptr<const SceneSnapshot> snapshot)
{
    State before = State::idle;
    if (!task_->state.compare_exchange_strong(before, State::running))
        return;
    try {
        const auto run = [task = task_, snapshot = std::move(snapshot)](const Progress& progress) {
            task->run(progress);
        };
        if (!run_in_background(run))
            task_->state = State::idle;
    } catch (...) { // no thread, or no memory
        task_->state = State::failed;
    }
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
