// The distance of points from the objects of a scene, for colours.
#pragma once

#include "isospline/scene/scene_points.h"
#include "isospline/shade/color.h"

#include <memory>
#include <mutex>
#include <vector>

namespace isospline {

/// The distance from the objects of a snapshot, in world units, negative inside of one if it is signed. Distances above
/// the largest one are that one.
class DistanceField : public PointValue {
public:
    DistanceField(std::shared_ptr<const SceneSnapshot> scene, bool is_signed, double largest);

    double at(const glm::dvec3& position_world) const override;

private:
    std::unique_ptr<SceneClosestPointFinder> take() const;

    std::shared_ptr<const SceneSnapshot> scene_;
    bool is_signed_;
    double largest_;
    mutable std::mutex mutex_;
    mutable std::vector<std::unique_ptr<SceneClosestPointFinder>> idle_; ///< each thread needs its own
};

} // namespace isospline
