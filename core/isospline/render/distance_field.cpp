#include "isospline/render/distance_field.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

namespace isospline {

DistanceField::DistanceField(std::shared_ptr<const SceneSnapshot> scene, bool is_signed, double largest)
    : scene_(std::move(scene)), is_signed_(is_signed), largest_(largest)
{
}

std::unique_ptr<SceneClosestPointFinder> DistanceField::take() const
{
    {
        const std::lock_guard lock(mutex_);
        if (!idle_.empty()) {
            auto finder = std::move(idle_.back());
            idle_.pop_back();
            return finder;
        }
    }
    ClosestPointOptions options;
    options.max_distance = largest_;
    return std::make_unique<SceneClosestPointFinder>(*scene_, options);
}

double DistanceField::at(const glm::dvec3& position_world) const
{
    auto finder = take();
    const double distance = std::min((*finder)(position_world).distance, largest_);
    {
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(finder));
    }
    if (!is_signed_)
        return distance;
    std::uint8_t is_inside = 0;
    find_occupancy(*scene_, std::span(&position_world, 1), std::span(&is_inside, 1));
    return is_inside != 0 ? -distance : distance;
}

} // namespace isospline
