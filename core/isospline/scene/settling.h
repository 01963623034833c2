// Better indexes for the objects of a scene, built in the background.
#pragma once

#include "isospline/scene/build_options.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/scene/snapshot_builder.h"
#include "isospline/util/progress.h"

#include <memory>

namespace isospline {

/// The settled versions of a snapshot's objects, built. Throws Cancelled if `progress` returns false.
Objects settled_objects(const SceneSnapshot::Impl& snapshot, const BuildOptions& options, const Progress& progress);

/// Calls settled_objects() in the background. The end of this object cancels that and does not wait for it. A fork and
/// the end of the process cancel it, too, and wait some milliseconds until the thread has stopped: otherwise a forked
/// child could inherit a lock that the thread holds.
class Settling {
public:
    enum class State { idle, running, done, failed };

    Settling(const SceneSnapshot::Impl& snapshot, const BuildOptions& options);
    ~Settling();
    Settling(const Settling&) = delete;
    Settling& operator=(const Settling&) = delete;

    /// Begins if it is idle: if it has not begun, or has been cancelled by a fork. `snapshot` is the same one.
    void begin(std::shared_ptr<const SceneSnapshot> snapshot);
    State state() const;
    /// The objects, once it is done.
    const Objects& objects() const;

private:
    struct Task;
    std::shared_ptr<Task> task_;
};

} // namespace isospline
