// The order in which queries of volumes on disk are answered.
#pragma once

#include "arrays.h"

#include "isospline/scene/scene_snapshot.h"
#include "isospline/spline/volume.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace isospline {

/// The order in which to visit the points or rays of a query. Those of a volume on disk are sorted by the place where
/// they first need its coefficients, so that chunks are read rarely, however little memory there is. Those of volumes
/// in memory keep their order. Results do not depend on it.
class VisitingOrder {
public:
    /// The given order.
    VisitingOrder() = default;
    VisitingOrder(const Volume& volume, const RowArray& points);
    VisitingOrder(const SceneSnapshot& scene, const RowArray& points);
    /// Rays are in rows of six numbers. `sees` are those that meet an object: SeenBy::camera or SeenBy::shadow.
    VisitingOrder(const SceneSnapshot& scene, bool SeenBy::*sees, const RowArray& rays, double t_near, double t_far);
    /// The order of places.
    explicit VisitingOrder(std::vector<std::size_t> places) : rows_(std::move(places)) {}

    bool is_given_order() const { return rows_.empty(); }
    /// The row to visit at a time.
    std::size_t operator[](std::size_t time) const { return rows_.empty() ? time : rows_[time]; }

private:
    /// Sorts rows by their keys.
    void sort(std::size_t count, const std::function<std::uint64_t(std::size_t)>& key_of_row);

    std::vector<std::size_t> rows_; ///< empty for the given order
};

} // namespace isospline
