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

/// One call of settled_objects() on a thread of its own. The end of this object cancels it and does not wait for it.
/// A fork() cancels it and waits until it has stopped, some milliseconds: the child then inherits no lock that the
/// thread holds. The end of the process does the same.
class Settling {
public:
    enum class State { running, done, cancelled, failed };

    /// Begins. If no thread can be started, it has failed.
    Settling(std::shared_ptr<const SceneSnapshot> snapshot, const SceneSnapshot::Impl& impl,
             const BuildOptions& options);
    ~Settling();
    Settling(const Settling&) = delete;
    Settling& operator=(const Settling&) = delete;

    State state() const;
    /// The objects, once it is done.
    const Objects& objects() const;

private:
    struct Task;
    std::shared_ptr<Task> task_;
};

} // namespace isospline
